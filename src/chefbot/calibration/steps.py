"""Steps of the calibration drive, and the goals of its motions."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.errors import ChefbotError
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import DriveOnHeading_Goal, Spin_Goal
from chefbot.robot.motion_limits import max_speed, max_turn
from chefbot.robot.spec import Robot

SPEED_FRACTION = 0.8
"""Fraction of the maximum speed: wheels below their limit slip less."""


class CalibrationDriveError(ChefbotError):
    """Raised when the drive ends early; the message is the reason."""


class Notice(NamedTuple):
    """A notice for the operator."""

    sentence: str


class Straight(NamedTuple):
    """A straight motion of `metres`, negative is backwards."""

    metres: float

    def goal(self, robot: Robot) -> DriveOnHeading_Goal:
        """Return the goal of this motion."""
        speed = SPEED_FRACTION * max_speed(robot)
        allowance = Duration.of(10.0 + 4.0 * abs(self.metres) / speed)
        return DriveOnHeading_Goal(Point(self.metres), math.copysign(speed, self.metres), allowance)


class Turn(NamedTuple):
    """A turn in place by `angle` radians, positive is left."""

    angle: float

    def goal(self, robot: Robot) -> Spin_Goal:
        """Return the goal of this motion."""
        return Spin_Goal(self.angle, Duration.of(10.0 + 4.0 * abs(self.angle) / max_turn(robot)))


class Look(NamedTuple):
    """Scans at standstill; the station ends a leg if `ends_leg`."""

    ends_leg: bool


Step = Notice | Straight | Turn | Look
LEG = Look(ends_leg=True)
