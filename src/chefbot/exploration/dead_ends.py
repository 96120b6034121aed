"""Places on the way at which drives of an exploration have ended: what lies behind is given up after a few."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2

AHEAD = 0.35
"""Distance ahead of a robot that does not come on at which a path counts as one through this place, m."""
SAME_PLACE = 0.25
"""Distance up to which two places are the same, and a path leads through a place, m."""
MAX_DRIVES = 3
"""Number of drives that may end at a place before no other is tried."""


class DeadEnds:
    """Counts drives that ended on the way, by the place just ahead of the robot on its path."""

    def __init__(self) -> None:
        self._places: list[tuple[float, float]] = []

    @property
    def exist(self) -> bool:
        """Whether enough drives have ended for a dead end."""
        return len(self._places) >= MAX_DRIVES

    def add(self, robot: SE2, path: NDArray[np.float64]) -> None:
        """Note that a drive has ended here; path: (n, 2 or 3) from the robot to its goal, m."""
        ahead = np.hypot(path[:, 0] - robot.x, path[:, 1] - robot.y) >= AHEAD
        if ahead.any():
            x, y = path[int(ahead.argmax()), :2]
            self._places.append((float(x), float(y)))

    def is_on(self, path: NDArray[np.float64]) -> bool:
        """Return whether a path (n, 2 or 3) leads through a place at which too many drives have ended."""
        places = np.array(self._places).reshape(-1, 2)
        for x, y in places:
            same = np.hypot(places[:, 0] - x, places[:, 1] - y) <= SAME_PLACE
            if same.sum() >= MAX_DRIVES and (np.hypot(path[:, 0] - x, path[:, 1] - y) <= SAME_PLACE).any():
                return True
        return False
