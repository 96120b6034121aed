"""The results of `chefbot robot design` for a robot."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.design.sizing.calculation import Result
from chefbot.design.sizing.component_selection import Verdict
from chefbot.design.sizing.requirements import Check
from chefbot.design.sizing.robot_file_editor import Change
from chefbot.robot.spec import Robot


class Sheet(NamedTuple):
    """The requested robot, both methods, every set of parts, and the chosen one."""

    name: str
    given: dict[str, str]
    """Command-line option to its requested value."""
    robot: Robot
    follows: list[Change]
    """Dependent changes of the geometry."""
    own: list[Check]
    """The checks of the file's own motor, driver and battery."""
    chapter: list[Result]
    candidates: list[Verdict]
    chosen: Verdict
    """The chosen set, or the nearest one if none passes."""
