"""Where the robot has been in the last seconds."""

from __future__ import annotations

import math
from collections import deque

from chefbot.maths.se2 import SE2

RECENT_TIME = 30.0
"""Time for which a pose is kept, s: a robot that took another path after it met an obstacle is well on its way."""
SPACING = 0.5
"""Distance from the pose before from which another one is kept, m: a fraction of any sensor's range."""


class RecentPoses:
    """The robot's poses of the last RECENT_TIME seconds."""

    def __init__(self) -> None:
        self._poses: deque[tuple[float, SE2]] = deque()

    def add(self, pose: SE2, time: float) -> list[SE2]:
        """Add the present pose at a time, s, and return all that are recent."""
        while self._poses and not 0.0 <= time - self._poses[0][0] <= RECENT_TIME:
            self._poses.popleft()
        if not self._poses or _distance(self._poses[-1][1], pose) > SPACING:
            self._poses.append((time, pose))
        return [*(before for _, before in self._poses), pose]


def _distance(a: SE2, b: SE2) -> float:
    return math.hypot(a.x - b.x, a.y - b.y)
