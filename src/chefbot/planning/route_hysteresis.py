"""Hysteresis of the route to a goal where marks of sensors come and go.

Where marks close every route, those out of sensor range are ignored: what they show may have left. If the edge of a
narrow passage is marked in one scan and free in the next, the shortest plan then changes between two routes with each
scan, and the robot turns on the spot between them.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.planning.global_planning import RETRY_WITHOUT_FAR_MARKS
from chefbot.planning.local_replanning import remaining_path
from chefbot.planning.planner import PlanningError

SWITCH_DELAY = 3.0
"""Time for which the other set of marks must be the right one before the robot changes to it, s: a few plans."""

Plan = Callable[[], NDArray[np.float64]]


class RouteHysteresis:
    """Plans around all marks or, where these close every route, without far ones; it changes only after a delay."""

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
            return self._while_closed(now, pose, without_far)
        return self._while_open(now, path, without_far)

    def _start(self, goal: SE2 | None) -> None:
        """Forget the route to another goal."""
        self._goal, self._ignores_far, self._differs_since = goal, False, float("nan")
        self._last_path: NDArray[np.float64] | None = None

    def _while_closed(self, now: float, pose: SE2, without_far: Plan) -> NDArray[np.float64]:
        """Return the last path around all marks for the delay, then one without far marks."""
        path = without_far()
        if not self._ignores_far and self._last_path is not None and not self._is_due(now):
            return remaining_path(self._last_path, pose)
        self._settle(ignores_far=True)
        return path

    def _while_open(self, now: float, path: NDArray[np.float64], without_far: Plan) -> NDArray[np.float64]:
        """Return a path without far marks for the delay if the robot follows such a one, else that around all."""
        self._last_path = path
        if self._ignores_far and not self._is_due(now):
            with contextlib.suppress(PlanningError):
                return without_far()
        self._settle(ignores_far=False)
        return path

    def _is_due(self, now: float) -> bool:
        """Return whether the other set of marks has been the right one for the delay."""
        if not now >= self._differs_since:
            self._differs_since = now
        return now - self._differs_since >= SWITCH_DELAY

    def _settle(self, *, ignores_far: bool) -> None:
        self._ignores_far, self._differs_since = ignores_far, float("nan")
