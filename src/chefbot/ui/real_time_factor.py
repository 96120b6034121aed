"""How fast the loop's time goes, against the wall's."""

from __future__ import annotations

from chefbot.runtime.clock import wall_ns

PERIOD_NS = 500_000_000


class Pace:
    """Seconds of the loop in a second of the wall, over the last half second."""

    def __init__(self, now_ns: int) -> None:
        self._since = (wall_ns(), now_ns)
        self._factor: float | None = None

    def factor(self, now_ns: int) -> float | None:
        """None before the first half second."""
        wall, (wall_before, before) = wall_ns(), self._since
        if wall - wall_before > PERIOD_NS:
            self._factor = (now_ns - before) / (wall - wall_before)
            self._since = (wall, now_ns)
        return self._factor
