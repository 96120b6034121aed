"""Detects a stale or frozen ultrasonic ranger by the stamps and the values of its echoes."""

from __future__ import annotations

import math

from chefbot.msgs.sensor_msgs import Range
from chefbot.safety.sensor_freshness import CLOCK_TOLERANCE_NS, MAX_AGE_PERIODS, MIN_MAX_AGE_NS

TITLE = "ultrasonic ranger"
FROZEN_ECHOES = 8
"""Equal finite ranges in a row that a ranger with noise does not send."""
NOISY_ECHOES = 20
"""Finite ranges in a row, each unlike the one before it, that show that a ranger has noise."""


class RangerMonitor:
    """Monitors the ranger by its messages and the clock. period: nominal time between two messages, s."""

    def __init__(self, period: float) -> None:
        self.limit_ns = max(round(MAX_AGE_PERIODS * period * 1e9), MIN_MAX_AGE_NS)
        self._last: Range | None = None
        self._received_ns = 0
        self._equal = self._unlike = 0
        self._noisy = False

    @property
    def has_sent(self) -> bool:
        """Whether the ranger has sent anything."""
        return self._last is not None

    def process_echo(self, echo: Range, now_ns: int) -> None:
        """Process an echo that was received at `now_ns`."""
        last, finite = self._last, math.isfinite(echo.range)
        repeats = finite and last is not None and last.range == echo.range
        self._equal = self._equal + 1 if repeats else 0
        self._unlike = self._unlike + 1 if finite and not repeats else 0
        self._noisy = self._noisy or self._unlike >= NOISY_ECHOES
        self._last, self._received_ns = echo, now_ns

    def fault(self, now_ns: int) -> str:
        """Return what is wrong with the ranger now, or an empty string."""
        last, limit = self._last, self.limit_ns
        if last is None:
            return f"The {TITLE} has not sent anything yet."
        if now_ns - self._received_ns > limit:
            return f"The {TITLE} has sent nothing for more than {limit / 1e9:.1f} s."
        if last.header.stamp.ns - now_ns > CLOCK_TOLERANCE_NS:
            return (
                f"The {TITLE}'s data are stamped in the future: compare its computer's clock with this one's."
            )
        if now_ns - last.header.stamp.ns > limit:
            return f"The {TITLE}'s data come late: they are more than {limit / 1e9:.1f} s old."
        if self._noisy and self._equal >= FROZEN_ECHOES:
            return f"The {TITLE} is frozen: it keeps sending the same range."
        return ""
