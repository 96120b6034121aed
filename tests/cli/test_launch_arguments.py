"""Tests that errors of commands with options name the options."""

from __future__ import annotations

import pytest

from chefbot.cli.app import main
from chefbot.cli.launch_arguments import hints_at_options, with_options
from chefbot.errors import UserError
from chefbot.robot.errors import RobotFileError


def test_arguments_of_a_launch_become_options() -> None:
    text = "no room there; the nearest free pose is start:='[1.00, 2.00, 0.00]', or unknown:=free"
    assert (
        with_options(text)
        == "no room there; the nearest free pose is --start '[1.00, 2.00, 0.00]', or --unknown free"
    )
    assert with_options("a restart:=x stays") == "a restart:=x stays"


def test_an_error_keeps_its_sentence() -> None:
    with pytest.raises(UserError, match="--start"), hints_at_options():
        raise RobotFileError("use start:='[0, 0, 0]'")


def test_a_demo_that_starts_in_a_wall_hints_at_its_option(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["chefbot", "demo", "--headless", "--world", "room", "--start", "[100, 0, 0]"]
    monkeypatch.setattr("sys.argv", arguments)
    with pytest.raises(SystemExit) as ended:
        main()
    error = capsys.readouterr().err
    assert ended.value.code == 2 and "--start" in error and "start:=" not in error
