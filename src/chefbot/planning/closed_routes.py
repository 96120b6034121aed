"""For how long every path to a goal has been closed."""

from __future__ import annotations

from chefbot.maths.se2 import SE2

STANDING_TIME = 15.0
"""Time after which what closes every path counts as standing and not as about to leave, s."""
MAX_GAP = 10.0
"""Time without a failed plan after which another closure begins, s: longer than any recovery, and than a path lasts
that opens for a moment while marks flicker."""


class ClosedRoutes:
    """Measures for how long plans to the same goal have failed again and again."""

    def __init__(self) -> None:
        self._goal: SE2 | None = None
        self._since = self._last = 0.0

    def is_standing(self, now: float, goal: SE2) -> bool:
        """Note that no path leads to the goal at a time, s; return whether that has been so for STANDING_TIME."""
        if goal != self._goal or not 0.0 <= now - self._last <= MAX_GAP:
            self._goal, self._since = goal, now
        self._last = now
        return now - self._since >= STANDING_TIME
