"""Measurement of message rate, jitter and bandwidth in constant memory."""

from __future__ import annotations

import math
from typing import NamedTuple


class Rate(NamedTuple):
    """Measured rate of a topic, with intervals between messages in s."""

    messages: int
    hz: float
    """Mean rate, Hz; 0 with fewer than two messages."""
    min_interval: float
    longest: float
    deviation: float
    bytes_per_second: float


class Meter:
    """A rate meter for one thread; running mean and standard deviation after Welford (1962)."""

    def __init__(self) -> None:
        self._count = 0
        self._last = self._first = 0.0
        self._mean = self._squares = 0.0
        self._shortest, self._longest = math.inf, 0.0
        self._bytes = 0

    @property
    def span(self) -> float:
        """Time from the first message to the last, s."""
        return self._last - self._first

    def add(self, at: float, size: int) -> None:
        """Add a message of `size` bytes that arrived at `at` seconds."""
        self._count += 1
        if self._count == 1:
            self._first = self._last = at
            return
        gap, self._last = at - self._last, at
        # Welford's update of the mean and the sum of squared deviations
        difference = gap - self._mean
        self._mean += difference / (self._count - 1)
        self._squares += difference * (gap - self._mean)
        self._shortest, self._longest = min(self._shortest, gap), max(self._longest, gap)
        self._bytes += size

    def rate(self) -> Rate:
        """Return the rate measured so far."""
        gaps = self._count - 1
        if gaps < 1 or self.span <= 0:
            return Rate(self._count, 0.0, 0.0, 0.0, 0.0, 0.0)
        deviation = math.sqrt(max(0.0, self._squares) / gaps)
        bandwidth = self._bytes / self.span
        return Rate(self._count, gaps / self.span, self._shortest, self._longest, deviation, bandwidth)
