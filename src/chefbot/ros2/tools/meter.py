"""How often something comes, how regularly, and how much of it: in constant memory, however long it is watched."""

from __future__ import annotations

import math
from typing import NamedTuple


class Rate(NamedTuple):
    """What was measured of a topic. Intervals in seconds."""

    messages: int
    hz: float
    """0 with less than two messages."""
    shortest: float
    longest: float
    deviation: float
    bytes_per_second: float


class Meter:
    """Fed by one thread; mean and deviation are Welford's (1962)."""

    def __init__(self) -> None:
        self._count = 0
        self._last = self._first = 0.0
        self._mean = self._squares = 0.0
        self._shortest, self._longest = math.inf, 0.0
        self._bytes = 0

    @property
    def span(self) -> float:
        """Seconds from the first message to the last."""
        return self._last - self._first

    def add(self, at: float, size: int) -> None:
        """A message that came at `at` seconds and had so many bytes."""
        self._count += 1
        if self._count == 1:
            self._first = self._last = at
            return
        gap, self._last = at - self._last, at
        difference = gap - self._mean
        self._mean += difference / (self._count - 1)
        self._squares += difference * (gap - self._mean)
        self._shortest, self._longest = min(self._shortest, gap), max(self._longest, gap)
        self._bytes += size

    def rate(self) -> Rate:
        """So far."""
        gaps = self._count - 1
        if gaps < 1 or self.span <= 0:
            return Rate(self._count, 0.0, 0.0, 0.0, 0.0, 0.0)
        deviation = math.sqrt(max(0.0, self._squares) / gaps)
        speed = self._bytes / self.span
        return Rate(self._count, gaps / self.span, self._shortest, self._longest, deviation, speed)
