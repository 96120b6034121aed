"""Sequence of the recovery behaviors, as data."""

from __future__ import annotations

import math
from enum import Enum
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import BackUp_Goal, Spin_Goal
from chefbot.robot.motion_limits import max_speed
from chefbot.robot.spec import Robot

BACK_UP_SPEED_FRACTION = 0.4
"""Fraction of the maximum speed for backing up: the sensors look forward, not back."""


class RecoveryBehavior(Enum):
    """Recovery behaviors that can be run, least intrusive first."""

    CLEAR = "forget obstacles seen around"
    BACK_UP = "back up"
    SPIN = "turn about and look"
    WAIT = "wait for people to pass"


DEFAULT_SEQUENCE = tuple(RecoveryBehavior)
"""Default sequence; the path is planned again after each behavior."""
LOOK_AHEAD_SEQUENCE = (
    RecoveryBehavior.SPIN,
    RecoveryBehavior.WAIT,
    RecoveryBehavior.CLEAR,
    RecoveryBehavior.BACK_UP,
)
"""Sequence for a robot whose sensors look ahead only.

Turning clears obstacles that have left, and the robot does not clear, or back into, an area that it has not just
scanned."""


def recovery_sequence(*, forward_sensing_only: bool) -> tuple[RecoveryBehavior, ...]:
    """Return the recovery sequence for a robot with such sensors."""
    return LOOK_AHEAD_SEQUENCE if forward_sensing_only else DEFAULT_SEQUENCE


UNRECOVERABLE_ERRORS = (204, 104)
"""Error codes for which no recovery behavior is tried; 204: the goal is outside the map (ComputePathToPose), 104: the
timeout while waiting for a sensor or for localization has passed (FollowPath)."""


class RecoveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the recovery behaviors and their number of rounds."""

    back_up: Annotated[float, Meta(ge=0.02, le=1.0, description="how far to back up, m")] = 0.2
    spin: Annotated[float, Meta(ge=0.1, le=12.6, description="how far to turn about, rad")] = 2.0 * math.pi
    wait: Annotated[float, Meta(ge=0.1, le=600.0, description="how long to wait, s")] = 5.0
    clear_radius: Annotated[
        float, Meta(ge=0.1, le=20.0, description="seen obstacles this near are forgotten, m")
    ] = 2.0
    rounds: Annotated[int, Meta(ge=1, le=100, description="times through the order before giving up")] = 2

    @property
    def spin_goal(self) -> Spin_Goal:
        """The goal of the recovery behavior SPIN."""
        return Spin_Goal(self.spin, Duration.of(30.0))

    def back_up_goal(self, robot: Robot) -> BackUp_Goal:
        """Return the goal of the recovery behavior BACK_UP."""
        speed = BACK_UP_SPEED_FRACTION * max_speed(robot)
        return BackUp_Goal(Point(-self.back_up), speed, Duration.of(10.0))


class NavigatorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the navigator: of replanning and of the recovery behaviors."""

    replan_period: Annotated[float, Meta(ge=0.2, le=60, description="replanning period while driving, s")] = (
        1.0
    )
    recovery: RecoveryParams = RecoveryParams()


class RecoverySequencer:
    """Selects the recovery behavior after each failure of a goal, and decides when to give up.

    forward_sensing_only: whether the robot's sensors look ahead only.
    """

    def __init__(self, *, forward_sensing_only: bool) -> None:
        self._sequence = recovery_sequence(forward_sensing_only=forward_sensing_only)
        self.count = 0
        """Number of recovery behaviors of the current goal."""

    def restart(self) -> None:
        """Begin again with the first behavior, for a new goal."""
        self.count = 0

    def gives_up(self, error_code: int, rounds: int) -> bool:
        """Return whether the goal fails with this error, after `rounds` times through the sequence at the latest."""
        return self.count >= rounds * len(self._sequence) or error_code in UNRECOVERABLE_ERRORS

    def next(self) -> RecoveryBehavior:
        """Return the behavior to run now, and count it."""
        self.count += 1
        return self._sequence[(self.count - 1) % len(self._sequence)]
