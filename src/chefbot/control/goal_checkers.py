"""Is it there yet; does it still move."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2


class GoalParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of `GoalChecker`."""

    xy_tolerance: Annotated[float, Meta(ge=0.01, le=1.0, description="this near is there, m")] = 0.08
    yaw_tolerance: Annotated[float, Meta(ge=0.01, le=3.15, description="this well turned is there, rad")] = (
        0.1
    )


class GoalChecker:
    """Latches the place: once near enough the robot only turns, however far the estimate of its pose then
    slides."""

    def __init__(self, params: GoalParams | None = None) -> None:
        self.params = params or GoalParams()
        self.there = False

    def reset(self) -> None:
        """A new goal."""
        self.there = False

    def near(self, pose: SE2, goal: SE2) -> bool:
        """Whether the place was reached, now or before."""
        self.there = self.there or pose.distance(goal) <= self.params.xy_tolerance
        return self.there

    def turned(self, pose: SE2, goal: SE2) -> bool:
        """Whether the robot looks where the goal says."""
        return abs(wrap(goal.yaw - pose.yaw)) <= self.params.yaw_tolerance


class ProgressChecker:
    """Stuck is: neither moved by `distance` (m) nor turned by `angle` (rad) for `patience` seconds."""

    def __init__(self, distance: float = 0.1, angle: float = 0.5, patience: float = 8.0) -> None:
        self.distance, self.angle, self.patience = distance, angle, patience
        self.reset()

    def reset(self) -> None:
        """A new goal, or a recovery has ended."""
        self._from: SE2 | None = None
        self._still = 0.0

    def moving(self, pose: SE2, dt: float) -> bool:
        """Call every `dt` seconds while it should move; False once it is stuck."""
        last = self._from
        turned = last is not None and abs(wrap(pose.yaw - last.yaw)) >= self.angle
        if last is None or turned or pose.distance(last) >= self.distance:
            self._from, self._still = pose, 0.0
        else:
            self._still += dt
        return self._still < self.patience
