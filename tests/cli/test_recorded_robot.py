"""Which robot's log a command reads."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.cli.drive.recorded_robot import recorded_robot
from chefbot.errors import UserError


def chosen(robot: str, *robots: str) -> str:
    return recorded_robot(robot, robots, "logs", Path("/state/audit"))


def test_the_only_robot_needs_no_name() -> None:
    assert chosen("", "anna") == chosen("anna", "anna") == chosen("anna", "anna", "bob") == "anna"


@pytest.mark.parametrize(
    ("robot", "robots", "sentence"),
    [
        ("", (), r"^there are no logs in /state/audit$"),
        ("", ("anna", "bob"), r"^there are logs of anna, bob; name a robot$"),
        (
            "ana",
            ("anna", "bob"),
            r"^no logs of robot 'ana' .*did you mean 'anna'.*there are logs of anna, bob$",
        ),
        ("anna", (), r"^no logs of robot 'anna'.*; there are no logs in /state/audit$"),
    ],
)
def test_a_missing_log_is_reported_in_one_sentence(
    robot: str, robots: tuple[str, ...], sentence: str
) -> None:
    with pytest.raises(UserError, match=sentence):
        chosen(robot, *robots)
