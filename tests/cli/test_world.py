"""`chefbot world`: generated world files with their maps, pictures, tables, and bad input in one sentence."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.support.ros_maps import MAPS
from typer.testing import CliRunner

from chefbot.buildings.parameters import COMMON, KINDS
from chefbot.cli.app import app, main
from chefbot.cli.world.draw import picture
from chefbot.cli.world.kinds import list_kinds
from chefbot.maths.grid import FREE, OCCUPIED
from chefbot.plural import number_of
from chefbot.robot.load import load_robot
from chefbot.sim.world.load import load_any_world
from chefbot.sim.world.world import load_world
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_places, places_path


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["chefbot", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    return int(str(end.value.code or 0))


def test_a_generated_world_has_a_map_in_its_frame(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    out = tmp_path / "new" / "home3.yaml"
    arguments = ("--seed", "3", "--robot", "chefbot_lidar", "--out", str(out))
    assert run(monkeypatch, "world", "generate", "home", *arguments) == 0
    world, grid = load_world(str(out)), load_map(tmp_path / "new" / "home3.map.yaml")
    places = load_places(places_path(tmp_path / "new" / "home3.map.yaml"))
    assert places.keys() == world.places.keys()
    for name, pose in world.places.items():
        assert tuple(places[name]) == pytest.approx(tuple(pose), abs=1e-3)
    assert all(grid.at(pose.x, pose.y) == FREE for pose in world.places.values())
    wall = next(shape for shape in world.static if shape.name.startswith("wall"))
    assert grid.at(wall.x, wall.y) == OCCUPIED
    first = out.read_bytes()
    assert run(monkeypatch, "world", "generate", "home", *arguments) == 0
    assert out.read_bytes() == first


def test_the_first_line_of_the_file_repeats_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    out = tmp_path / "w.yaml"
    arguments = ("generate", "hall", "--seed", "5", "--size", "16x14", "--set", "clutter=0.01")
    assert run(monkeypatch, "world", *arguments, "--robot", "chefbot", "--out", str(out)) == 0
    expected = "# chefbot world generate hall --seed 5 --size 16x14 --set clutter=0.01 --robot chefbot"
    assert out.read_text().splitlines()[0] == expected
    x0, y0, x1, y1 = load_world(str(out)).bounds
    assert (x1 - x0, y1 - y0) == pytest.approx((16.12, 14.12), abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("generate offce", "did you mean 'office'"),
        ("generate office --size 30", "as 30x20"),
        ("generate office --size 300x20", "from 15 to 45 m"),
        ("generate twins --size 30x20", "no width and depth"),
        ("generate office --set clutter", "as --set clutter=0.05"),
        ("generate office --set clutter=nan", "a finite number"),
        ("generate office --set cluter=0.1", "did you mean 'clutter'"),
        ("generate office --out world.json", "ends in .yaml"),
        ("draw hotel --out world.jpg", "ends in .png"),
        ("draw hotl --out world.png", "did you mean 'hotel'"),
        ("kinds offce", "did you mean 'office'"),
    ],
)
def test_bad_input_is_reported_in_one_sentence(
    arguments: str,
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "world", *arguments.split()) == 2
    error = capsys.readouterr().err
    assert message in " ".join(error.split())
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


def test_the_picture_shows_walls_where_they_are() -> None:
    robot = load_robot("chefbot")
    world = load_any_world("room", robot)
    image = np.asarray(Image.open(io.BytesIO(picture(world, robot))).convert("L"), np.float64)
    assert image.shape[0] > 300 and image.shape[1] > 300
    assert image.std() > 10.0, "not a blank page"


def test_the_table_of_kinds_names_all_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    list_kinds("")
    shown = capsys.readouterr().out
    assert all(name in shown for kind in KINDS.values() for name in kind)
    assert all(name in shown for name in COMMON)
    list_kinds("narrow")
    shown = capsys.readouterr().out
    assert "gap" in shown and "blocks_x" not in shown


def test_a_map_is_drawn_with_start_unknown_cells_and_places(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    yaml = next(one for one in MAPS if one.name == "unknown_is_free").write(tmp_path)
    out = tmp_path / "map.png"
    arguments = ("world", "draw", str(yaml), "--robot", "chefbot_lidar", "--out", str(out))
    assert run(monkeypatch, *arguments) == 0
    assert "largest free area" in " ".join(capsys.readouterr().out.split())
    drawn = np.asarray(Image.open(out).convert("L"))
    start = ("--start", "[-1, 3, 0.5]", "--unknown", "free", "--seed", "7")
    assert run(monkeypatch, *arguments, *start) == 0
    output = capsys.readouterr().out
    assert "7 places" in output and "start [-1.00, 3.00, 0.50], as requested" in output
    lighter = np.asarray(Image.open(out).convert("L"))
    assert lighter.mean() > drawn.mean() + 20, "what was wall outside is floor now"
    assert run(monkeypatch, *arguments, "--start", "[-1, 3, 0.5]") == 2
    assert "lies in a wall" in capsys.readouterr().err


@pytest.mark.parametrize("command", [("demo", "--headless"), ("robot", "export", "sdf"), ("sim",)])
def test_every_command_with_a_world_checks_its_start(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    command: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    yaml = str(next(one for one in MAPS if one.name == "no_comment").write(tmp_path))
    world = (yaml, "headless:=true") if command == ("sim",) else ("--world", yaml)
    for option, sentence in [
        (("--start", "[99, 0, 0]"), f"map {yaml}: the start (99.00, 0.00) lies off the map"),
        (("--start", "[1, 2]"), "must be three numbers"),
        (("--unknown", "walls"), "walls"),
    ]:
        assert run(monkeypatch, *command, *world, *option) == 2
        stderr = " ".join(capsys.readouterr().err.split())
        assert sentence in stderr and stderr.count("chefbot: ") == 1


def test_hints_of_draw_name_its_own_options(tmp_path: Path) -> None:
    arguments = ["world", "draw", "room", "--out", str(tmp_path / "w.png")]
    for start in ("[1, 2]", "[90, 90, 0]"):
        error = CliRunner().invoke(app, [*arguments, "--start", start]).exception
        assert "--start '" in str(error) and ":=" not in str(error)


def test_one_thing_is_not_in_the_plural() -> None:
    assert (number_of(1, "place"), number_of(2, "place"), number_of(0, "solid")) == (
        "1 place",
        "2 places",
        "0 solids",
    )
