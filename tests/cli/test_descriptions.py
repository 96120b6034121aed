"""Exports of a robot as text: to standard output or a file, byte for byte the same."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest

from chefbot.cli.robot.descriptions import output, run_mjcf, run_sdf
from chefbot.errors import ChefbotError
from chefbot.robot.errors import RobotFileError
from chefbot.storage.atomic_files import StorageError

EXPORTS: dict[str, Callable[[str, Path | None], None]] = {
    "sdf": lambda robot, out: run_sdf(robot, None, out),
    "world": lambda robot, out: run_sdf(robot, "empty", out),
    "mjcf": run_mjcf,
}


@pytest.mark.parametrize("name", EXPORTS)
def test_a_file_gets_what_standard_output_gets(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    EXPORTS[name]("chefbot", None)
    printed = capsys.readouterr().out
    EXPORTS[name]("chefbot", tmp_path / "new" / "file")
    assert capsys.readouterr().out == ""
    assert (tmp_path / "new" / "file").read_bytes() == printed.encode()
    assert printed.endswith("\n") and not printed.endswith("\n\n")


def test_a_world_contains_the_robot_and_a_model_no_world(capsys: pytest.CaptureFixture[str]) -> None:
    run_sdf("chefbot", None, None)
    model = ET.fromstring(capsys.readouterr().out)
    assert model.find("world") is None and model.find("model") is not None
    run_sdf("chefbot", "empty", None)
    world = ET.fromstring(capsys.readouterr().out).find("world")
    assert world is not None and any(one.get("name") == "chefbot" for one in world.iter("model"))


@pytest.mark.parametrize("name", EXPORTS)
def test_an_unknown_robot_writes_nothing(name: str, tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match="did you mean 'chefbot'"):
        EXPORTS[name]("chefbott", tmp_path / "file")
    assert not (tmp_path / "file").exists()


def test_an_unknown_world_is_reported_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ChefbotError, match="hotell"):
        run_sdf("chefbot", "hotell", tmp_path / "file")


def test_text_is_written_as_utf_8_over_an_old_file(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("a longer text")
    output("µ\n", tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == b"\xc2\xb5\n"
    with pytest.raises(StorageError):
        output("text", tmp_path / "a" / "b")
