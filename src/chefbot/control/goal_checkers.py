"""Goal checker and progress checker of the path follower."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2


class GoalParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Goal tolerances, the parameters of `GoalChecker`."""

    xy_tolerance: Annotated[float, Meta(ge=0.01, le=1.0, description="position tolerance, m")] = 0.08
    yaw_tolerance: Annotated[float, Meta(ge=0.01, le=3.15, description="heading tolerance, rad")] = 0.1


class GoalChecker:
    """A stateful goal checker: once the position is within tolerance the robot only turns to the goal's heading,
    even if the pose estimate drifts out of tolerance afterwards."""

    def __init__(self, params: GoalParams | None = None) -> None:
        self.params = params or GoalParams()
        self.latched = False

    def reset(self) -> None:
        """Clear the latch for a new goal."""
        self.latched = False

    def position_reached(self, pose: SE2, goal: SE2) -> bool:
        """Return whether the position is within tolerance of the goal, now or since the last reset."""
        self.latched = self.latched or pose.distance(goal) <= self.params.xy_tolerance
        return self.latched

    def heading_reached(self, pose: SE2, goal: SE2) -> bool:
        """Return whether the heading is within tolerance of the goal's heading."""
        return abs(wrap(goal.yaw - pose.yaw)) <= self.params.yaw_tolerance


class ProgressChecker:
    """Detects a stuck robot: neither moved by `distance` (m) nor turned by `angle` (rad) for `patience` seconds."""

    def __init__(self, distance: float = 0.1, angle: float = 0.5, patience: float = 8.0) -> None:
        self.distance, self.angle, self.patience = distance, angle, patience
        self.reset()

    def reset(self) -> None:
        """Restart the check, for a new goal or after a recovery behavior."""
        self._baseline_pose: SE2 | None = None
        self._time_without_progress = 0.0

    def is_progressing(self, pose: SE2, dt: float) -> bool:
        """Return False once the robot is stuck; call every `dt` seconds while it should move."""
        last = self._baseline_pose
        turned = last is not None and abs(wrap(pose.yaw - last.yaw)) >= self.angle
        if last is None or turned or pose.distance(last) >= self.distance:
            self._baseline_pose, self._time_without_progress = pose, 0.0
        else:
            self._time_without_progress += dt
        return self._time_without_progress < self.patience
