"""Decides when a robot creeps through a passage that is little wider than its body.

A costmap keeps the robot's centre at the inscribed radius, a margin and a cell from each marked cell: wherever robot
and obstacle are in their cells, they do not touch. A passage in which that leaves nothing may still be wide enough.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.se2 import SE2

PATIENCE = 1.0
"""Time for which the path is blocked near the robot before a narrow passage is tried, s: people pass by."""
NEAR_LENGTH = 0.5
"""Length of the path ahead that is blocked, or free again behind the passage, m."""
LENGTH = 1.0
"""Length of the path ahead that must be free with narrow passages open, m."""

Replan = Callable[[NDArray[np.float64], SE2, Costmap], NDArray[np.float64]]
Collides = Callable[[NDArray[np.float64], SE2, Costmap, float], bool]


class NarrowPassage:
    """Selects the costs that a robot drives on: the usual ones, or those with narrow passages open.

    replan: leads a path (n, 3) around the obstacles in costs, as `replan_locally` does. collides: whether a path
    collides within a distance (m) from a pose, as `collides_within`. period: time between two calls, s. Poses, paths
    and costs are in one frame that does not jump.
    """

    def __init__(self, replan: Replan, collides: Collides, period: float) -> None:
        self._replan, self._collides, self._period = replan, collides, period
        self._entrance: SE2 | None = None
        self._blocked_time = 0.0

    @property
    def entered(self) -> bool:
        """Whether the robot is in a narrow passage."""
        return self._entrance is not None

    @property
    def is_near(self) -> bool:
        """Whether the robot is in a narrow passage, or before something that may be one."""
        return self.entered or self._blocked_time > 0.0

    def select(
        self,
        given: NDArray[np.float64],
        followed: NDArray[np.float64],
        pose: SE2,
        usual: Costmap,
        narrow: Callable[[], Costmap],
        *,
        stands: bool = False,
    ) -> Costmap:
        """Return the costs to drive on; `narrow` returns those with narrow passages open.

        given: the path to follow, followed: the same with the detours of the last cycle, both (n, 3). stands: whether
        there was no command in the last cycle.
        """
        if self._entrance is not None:
            self._blocked_time = 0.0
            is_behind = pose.distance(self._entrance) > NEAR_LENGTH and usual.at(pose.x, pose.y) < INSCRIBED
            if is_behind and not self._is_blocked(given, pose, usual, NEAR_LENGTH):
                self._entrance = None
        elif self._is_blocked_for_long(stands or self._collides(followed, pose, usual, NEAR_LENGTH)):
            self._entrance = None if self._is_blocked(given, pose, narrow(), LENGTH) else pose
        return narrow() if self.entered else usual

    def _is_blocked_for_long(self, blocked: bool) -> bool:
        """Return whether the robot, or its path near it, has been blocked for PATIENCE since the last True."""
        self._blocked_time = self._blocked_time + self._period if blocked else 0.0
        for_long = self._blocked_time >= PATIENCE
        # so much time again until the next try
        self._blocked_time = self._period if for_long else self._blocked_time
        return for_long

    def _is_blocked(self, given: NDArray[np.float64], pose: SE2, costs: Costmap, length: float) -> bool:
        """Return whether a path is blocked within a length ahead, m, also after replanning."""
        return self._collides(self._replan(given, pose, costs), pose, costs, length)
