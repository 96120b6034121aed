"""Real-time factor of the event loop."""

from __future__ import annotations

from chefbot.runtime.clock import wall_ns

PERIOD_NS = 500_000_000
"""Period over which the factor is measured, ns."""


class RealTimeFactor:
    """Real-time factor: loop time over wall time, measured over the last half second."""

    def __init__(self, now_ns: int) -> None:
        self._start = (wall_ns(), now_ns)
        self._factor: float | None = None

    def factor(self, now_ns: int) -> float | None:
        """Return the latest factor; None before the first half second."""
        wall_now, (wall_start, start) = wall_ns(), self._start
        if wall_now - wall_start > PERIOD_NS:
            self._factor = (now_ns - start) / (wall_now - wall_start)
            self._start = (wall_now, now_ns)
        return self._factor
