"""Hysteresis of the route to a goal where marks of sensors come and go.

Where marks close every route, those out of sensor range are ignored: what they show may have left. If the edge of a
narrow passage is marked in one scan and free in the next, the shortest plan then changes between two routes with each
scan, and the robot turns on the spot between them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.planning.global_planning import RETRY_WITHOUT_FAR_MARKS
from chefbot.planning.local_replanning import remaining_path
from chefbot.planning.planner import PlanningError

SWITCH_DELAY = 3.0
"""Time for which another route must be the best one before the robot changes to it, s: a few plans."""
CLOSED_MEMORY = 30.0
"""Time after all marks have closed every route for which the delay applies, s."""
SAME_ROUTE = 0.75
"""Deviation of two paths up to which they are the same route, m: a way round an obstacle and not another passage."""
STRIDE = 4
"""One in so many poses of a path is compared; they are 5 cm apart."""

Plan = Callable[[], NDArray[np.float64]]


class RouteHysteresis:
    """Plans around all marks or, where these close every route, without far ones, with hysteresis."""

    def __init__(self) -> None:
        self._start(None)

    def plan(
        self, now: float, pose: SE2, goal: SE2, *, around_all: Plan, without_far: Plan
    ) -> NDArray[np.float64]:
        """Return the path (n, 3) from the robot's pose to the goal, in the map, at time `now`, s.

        around_all: plans around all marks; without_far: without those out of sensor range. Raises PlanningError.
        """
        if goal != self._goal:
            self._start(goal)
        try:
            path = around_all()
        except PlanningError as error:
            if error.failure not in RETRY_WITHOUT_FAR_MARKS:
                raise
            path, self._closed_at = without_far(), now
        return self._choose(now, path, pose)

    def _start(self, goal: SE2 | None) -> None:
        """Forget the route to another goal."""
        self._goal = goal
        self._path: NDArray[np.float64] | None = None
        self._planned_at, self._closed_at, self._differs_since = -math.inf, -math.inf, math.inf

    def _choose(self, now: float, path: NDArray[np.float64], pose: SE2) -> NDArray[np.float64]:
        """Return the new path or, if it is another route that is not due, the rest of the one that is followed."""
        is_followed = 0.0 <= now - self._planned_at <= SWITCH_DELAY
        self._planned_at = now
        if self._path is not None and is_followed and now - self._closed_at <= CLOSED_MEMORY:
            rest = remaining_path(self._path, pose)
            if _deviation(path, rest) > SAME_ROUTE and not self._is_due(now):
                return rest
        self._path, self._differs_since = path, math.inf
        return path

    def _is_due(self, now: float) -> bool:
        """Return whether the best route has been another one for the delay."""
        self._differs_since = min(self._differs_since, now)
        return now - self._differs_since >= SWITCH_DELAY


def _deviation(path: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the largest distance of a pose of a path (n, 3) from the nearest one of the other (m, 3), m."""
    a, b = path[::STRIDE], other[::STRIDE]
    return float(np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1]).min(axis=1).max())
