"""In which order to get out of trouble, as data."""

from __future__ import annotations

import math
from enum import Enum
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from chefbot.behavior.behavior import Behavior
from chefbot.behavior.motions import Spin, Straight, Wait
from chefbot.robot.spec import Robot

CAREFUL = 0.4
"""Share of the robot's speed for recoveries: its sensors look forward, not back."""


class Recovery(Enum):
    """What can be tried."""

    CLEAR = "forget obstacles seen around"
    BACK_UP = "back up"
    SPIN = "turn about and look"
    WAIT = "wait for people to pass"


ORDER = (Recovery.CLEAR, Recovery.BACK_UP, Recovery.SPIN, Recovery.WAIT)
"""After each of them the path is planned anew; the mildest comes first."""


class RecoveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of `Recoveries`."""

    back_up: Annotated[float, Meta(ge=0.02, le=1.0, description="how far to back up, m")] = 0.2
    spin: Annotated[float, Meta(ge=0.1, le=12.6, description="how far to turn about, rad")] = 2.0 * math.pi
    wait: Annotated[float, Meta(ge=0.1, le=600.0, description="how long to wait, s")] = 5.0
    clear_radius: Annotated[
        float, Meta(ge=0.1, le=20.0, description="seen obstacles this near are forgotten, m")
    ] = 2.0
    rounds: Annotated[int, Meta(ge=1, le=100, description="times through the order before giving up")] = 2


class Next(NamedTuple):
    """What to try: CLEAR has no motion, the caller clears its costmaps."""

    recovery: Recovery
    behavior: Behavior | None


class Recoveries:
    """Walks through ORDER, `rounds` times; progress starts it over."""

    def __init__(self, robot: Robot, params: RecoveryParams | None = None) -> None:
        self.params = params or RecoveryParams()
        self._robot = robot
        self._tried = 0

    def reset(self) -> None:
        """The robot has moved on, or has a new goal."""
        self._tried = 0

    def next(self) -> Next | None:
        """What to try now; None when all was tried."""
        if self._tried >= self.params.rounds * len(ORDER):
            return None
        recovery = ORDER[self._tried % len(ORDER)]
        self._tried += 1
        return Next(recovery, self._behavior(recovery))

    def _behavior(self, recovery: Recovery) -> Behavior | None:
        robot, p = self._robot, self.params
        if recovery is Recovery.BACK_UP:
            return Straight(-p.back_up, CAREFUL * robot.max_speed, robot.max_acceleration)
        if recovery is Recovery.SPIN:
            return Spin(p.spin, robot.max_turn, robot.max_turn_acceleration)
        return Wait(p.wait) if recovery is Recovery.WAIT else None
