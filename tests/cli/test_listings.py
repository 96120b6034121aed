"""Tables of the built-in robots and worlds, of two maps, and of this computer, as they are printed."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from chefbot.cli.doctor import report
from chefbot.cli.map.compare import compare_maps
from chefbot.cli.robot.built_in import list_robots
from chefbot.cli.world.built_in import list_worlds
from chefbot.maths.grid import Grid
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.sim.world.world import built_in_worlds, load_world
from chefbot.storage.map_files import save_map


def rows(text: str) -> dict[str, str]:
    """First word of each line to the line."""
    return {line.split()[0]: line for line in text.splitlines() if line.strip()}


def test_each_robot_is_listed_with_its_figures(capsys: pytest.CaptureFixture[str]) -> None:
    list_robots()
    table = rows(capsys.readouterr().out)
    for name in built_in_robots():
        robot, figures = load_robot(name), [float(word) for word in table[name].split()[1:]]
        assert len(figures) == 5
        assert figures[0] == pytest.approx(2.0 * robot.circumscribed_radius, abs=0.005)
        assert figures[3:] == pytest.approx([robot.drive.max_speed, robot.body.payload], abs=0.005)


def test_each_world_is_listed_with_its_size(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chefbot.cli.world.built_in.console.width", 300)
    list_worlds()
    table = rows(capsys.readouterr().out)
    for name in built_in_worlds():
        world = load_world(name)
        x0, y0, x1, y1 = world.bounds
        assert f"{x1 - x0:.1f} x {y1 - y0:.1f}" in table[name]
        assert all(place in table[name] for place in world.places)
        assert int(table[name].split()[-1]) == world.people.count


def room(path: Path, x: float = 0.0, y: float = 0.0) -> Path:
    """A room of 3 m x 2 m with a wall inside."""
    cells = np.zeros((40, 60), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = cells[20, 10:30] = 100
    return save_map(path, Grid(cells, 0.05, x, y))


def test_the_offset_of_a_map_is_in_metres(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    compare_maps(room(tmp_path / "moved", 0.15, -0.1), room(tmp_path / "truth"))
    out = capsys.readouterr().out
    x, y, yaw = map(float, re.findall(r"(?:x|y|yaw) ([+-][\d.]+)", out))
    assert (x, y) == pytest.approx((-0.15, 0.1), abs=0.03)
    assert yaw == pytest.approx(0.0, abs=1.0)
    assert rows(out)["aligned"].split()[1:] == ["100.0%"] * 3


def test_the_turn_of_a_map_is_in_degrees(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    along, across = np.meshgrid(np.linspace(0.5, 3.5, 400), [0.5, 1.5, 2.5])
    x, y = np.hstack(
        [[along.ravel(), across.ravel()], [np.repeat([0.5, 2.0, 3.5], 400), np.tile(along[0], 3) * 0.7]]
    )

    def turned(name: str, degrees: float) -> Path:
        c, s, cells = (
            math.cos(math.radians(degrees)),
            math.sin(math.radians(degrees)),
            np.zeros((100, 100), np.int8),
        )
        cells[((s * x + c * y + 0.5) / 0.05).astype(int), ((c * x - s * y + 0.5) / 0.05).astype(int)] = 100
        return save_map(tmp_path / name, Grid(cells, 0.05, -0.5, -0.5))

    compare_maps(turned("map", 4.0), turned("truth", 0.0))
    (yaw,) = re.findall(r"yaw ([+-][\d.]+) deg", capsys.readouterr().out)
    assert float(yaw) == pytest.approx(-4.0, abs=0.6)


def test_a_ratio_of_nothing_is_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    free = save_map(tmp_path / "free", Grid(np.zeros((40, 60), np.int8), 0.05, 0.0, 0.0))
    compare_maps(free, room(tmp_path / "truth"))
    cells = rows(capsys.readouterr().out)["aligned"].split()
    assert cells[1] == "none", "of no wall none can be right"
    assert not any(math.isnan(float(cell.rstrip("%"))) for cell in cells[2:])


@pytest.mark.parametrize("missing", [(), ("make", "avrdude")])
def test_missing_tools_are_named_with_what_they_are_for(
    missing: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for tool in set(report.TOOLS) - set(missing):
        (tmp_path / tool).touch(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(report, "graph_lines", lambda: ["no network"])
    monkeypatch.setattr(report, "LIBRARIES", ("numpy", "no-such-library"))
    report.print_report(everything=True)
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("kernels: not compiled yet"), "there is no stamp in an empty cache"
    assert lines[2] == f"libraries: numpy {np.__version__}, no-such-library missing"
    if missing:
        assert lines[3].startswith("not installed: ") and lines[3].count("(for `") == len(missing)
        assert all(f"{tool} (for `{report.TOOLS[tool]}`)" in lines[3] for tool in missing)
    else:
        assert lines[3] == "all tools are installed"
    assert "no network" in lines
    report.print_report(everything=False)
    assert "libraries" not in (out := capsys.readouterr().out) and "installed" not in out
