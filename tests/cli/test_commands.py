"""The commands of every group: all are explained, wrong values end with code 2, and nothing heavy is imported."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
import typer.main
from typer.testing import CliRunner

from chefbot.cli.app import main
from chefbot.cli.board.commands import board_app
from chefbot.cli.doctor.commands import doctor_app
from chefbot.cli.drive.commands import drive_app
from chefbot.cli.fleet.commands import fleet_app
from chefbot.cli.map.commands import map_app
from chefbot.cli.robot.commands import robot_app
from chefbot.cli.robot.export_commands import export_app
from chefbot.cli.run.commands import demo, launch, replay, sim
from chefbot.cli.run.prove import prove
from chefbot.cli.tools.commands import TOOLS
from chefbot.cli.world.commands import world_app
from chefbot.errors import UserError

GROUPS = {
    "board": board_app, "doctor": doctor_app, "drive": drive_app, "fleet": fleet_app, "map": map_app,
    "robot": robot_app, "robot export": export_app, "world": world_app, **TOOLS,
}  # fmt: skip


def commands() -> Iterator[tuple[str, Any]]:
    """Each command as it is typed, with Typer's object."""
    for name, group in GROUPS.items():
        for command in typer.main.get_command(group).commands.values():  # type: ignore[attr-defined]
            yield f"{name} {command.name}", command
    single = typer.Typer()
    for function in (demo, launch, replay, sim, prove):
        single.command()(function)
    yield from typer.main.get_command(single).commands.items()  # type: ignore[attr-defined]


@pytest.mark.parametrize(("line", "command"), [pytest.param(*each, id=each[0]) for each in commands()])
def test_each_command_and_parameter_is_explained(line: str, command: Any) -> None:
    assert command.help and command.help.strip().split("\n")[0].endswith(".")
    for parameter in command.params:
        if parameter.name not in ("help", "install_completion", "show_completion") and not hasattr(
            command, "commands"
        ):
            assert getattr(parameter, "help", None), f"{line}: {parameter.name}"


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["chefbot", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    return int(str(end.value.code or 0))


@pytest.mark.parametrize(
    "line",
    [
        "board monitor --seconds -1",
        "board monitor --seconds nan",
        "board log /dev/null --seconds soon",
        "board flash",
        "drive goto",
        "drive goto home --when later",
        "drive confirm perhaps",
        "drive order",
        "fleet request",
        "fleet sign none.request --role chef",
        "map slam log.gz --particles 0",
        "map slam log.gz --max-range nan",
        "map slam log.gz --seed -1",
        "map compare one.yaml",
        "robot export solids --format dxf",
        "robot export ros2",
        "robot export urdf --out a --package b",
        "robot calibrate --seed x",
        "demo --people 51",
        "demo --port 0",
        "demo --port 65536",
        "replay",
        "sim hotel people=3",
        "drive keyboard page",
        "launch explore world",
    ],
)
def test_a_wrong_value_is_reported_in_one_sentence_with_code_2(
    line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, *line.split()) == 2
    stderr = capsys.readouterr().err
    assert stderr.startswith("chefbot: ") and stderr.count("\n") == 1 and "Traceback" not in stderr


def test_a_missing_file_is_reported_in_one_sentence_with_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for line in (
        "map compare a.yaml b.yaml", "map slam none.log", "robot check none.yaml", "robot check-urdf none.urdf",
        "fleet sign none.request", "fleet accept none.card", "replay none.mcap", "board check /dev/none",
    ):  # fmt: skip
        assert run(monkeypatch, *line.split()) == 2, line
        assert "none" in (stderr := capsys.readouterr().err) or "a.yaml" in stderr, line
    assert list(tmp_path.iterdir()) == []


def test_a_urdf_is_a_file_or_a_package() -> None:
    done = CliRunner().invoke(export_app, ["urdf", "--out", "a", "--package", "b"])
    assert isinstance(done.exception, UserError) and "give one of them" in str(done.exception)


def test_the_commands_that_write_robots_print_the_path(tmp_path: Path) -> None:
    done = CliRunner().invoke(robot_app, ["export", "urdf", "desk", "--out", str(tmp_path / "desk.urdf")])
    assert done.exit_code == 0 and (tmp_path / "desk.urdf").read_text().startswith("<?xml")
    done = CliRunner().invoke(robot_app, ["export", "mjcf", "desk"])
    assert done.output.startswith("<mujoco")


def test_order_0_is_not_all_orders() -> None:
    done = CliRunner().invoke(drive_app, ["cancel", "--order", "0"])
    assert done.exit_code == 2
