"""Detours of the global plan: a new plan to the same goal that leads elsewhere because the old one is blocked."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.causes.obstacles import CellCentre, blocked_index, nearest_lethal
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2

SAME_GOAL_DISTANCE = 0.05
"""Distance between two goals up to which they are the same, m."""
MIN_DEVIATION = 0.5
"""Distance from the old plan from which a new one is a detour, m: half the width of a corridor."""


class PlannedDetour(NamedTuple):
    """The obstacle on the old plan, how far the new one leads from it, and how much longer it is; m."""

    obstacle: CellCentre
    deviation: float
    extra_length: float


class NewGoals:
    """Detects whether a goal differs from the last one."""

    def __init__(self) -> None:
        self._goal: SE2 | None = None

    def is_new(self, goal: SE2) -> bool:
        """Return whether a goal is not the last one, and keep it."""
        before, self._goal = self._goal, goal
        return before is None or before.distance(goal) > SAME_GOAL_DISTANCE


class DetourDetector:
    """Compares each plan with the one before."""

    def __init__(self) -> None:
        self._plan = np.zeros((0, 3))
        self._goals = NewGoals()

    def process(
        self, plan: NDArray[np.float64], goal: SE2, robot: SE2, costs: Costmap
    ) -> PlannedDetour | None:
        """Return the detour of a new plan (n, 3) to `goal`, or None. All in the costmap's frame."""
        before, self._plan = self._plan, plan
        if self._goals.is_new(goal) or not len(before):
            return None
        rest = before[int(np.argmin(np.hypot(before[:, 0] - robot.x, before[:, 1] - robot.y))) :]
        gaps = np.hypot(plan[::4, None, 0] - before[None, ::2, 0], plan[::4, None, 1] - before[None, ::2, 1])
        away = float(gaps.min(axis=1).max())
        if away < MIN_DEVIATION:
            return None
        blocked = blocked_index(costs, rest)
        if blocked is None:
            return None
        obstacle = nearest_lethal(costs, float(rest[blocked, 0]), float(rest[blocked, 1]))
        return None if obstacle is None else PlannedDetour(obstacle, away, _length(plan) - _length(rest))


def _length(path: NDArray[np.float64]) -> float:
    return float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())
