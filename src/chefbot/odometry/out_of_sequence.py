"""Readings arrive late and out of order; the estimate is as if they had not.

The last readings are kept in the order of their stamps, each with the belief after it. One that comes late is
put where it belongs, and those behind it are worked in again (Bar-Shalom 2002, "Update with out-of-sequence
measurements in tracking: exact solution", compares this with formulas that spare the work).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from typing import Generic, TypeVar

from chefbot.odometry.readings import Key, Reading, order

Belief = TypeVar("Belief")


class History(Generic[Belief]):
    """Beliefs over the last `horizon_ns` before the newest stamp; what is older can no longer be changed.

    `fold(belief, reading)` must be a pure function that returns a new belief.
    """

    def __init__(self, fold: Callable[[Belief, Reading], Belief], start: Belief, horizon_ns: int) -> None:
        self._fold, self._base, self._horizon_ns = fold, start, horizon_ns
        self._keys: list[Key] = []
        self._readings: list[Reading] = []
        self._beliefs: list[Belief] = []

    @property
    def latest(self) -> Belief:
        """After the newest reading."""
        return self._beliefs[-1] if self._beliefs else self._base

    @property
    def newest_ns(self) -> int | None:
        """The newest stamp, None before the first reading."""
        return self._keys[-1][0] if self._keys else None

    def add(self, reading: Reading) -> bool:
        """Work it in where it belongs; False if it is too old or here already."""
        newest = self.newest_ns
        if newest is not None and reading.stamp_ns <= newest - self._horizon_ns:
            return False
        key = order(reading)
        at = bisect_left(self._keys, key)
        if at < len(self._keys) and self._keys[at] == key:
            return False
        after = self._folded(at, [reading, *self._readings[at:]])  # may raise; until here nothing has changed
        self._keys.insert(at, key)
        self._readings.insert(at, reading)
        self._beliefs[at:] = after
        self._trim()
        return True

    def _folded(self, at: int, readings: list[Reading]) -> list[Belief]:
        """The beliefs after each of the readings, from the belief before place `at` on."""
        belief, beliefs = self._beliefs[at - 1] if at else self._base, []
        for reading in readings:
            belief = self._fold(belief, reading)
            beliefs.append(belief)
        return beliefs

    def _trim(self) -> None:
        old = bisect_left(self._keys, (self._keys[-1][0] - self._horizon_ns + 1, -1, ""))
        if old:
            self._base = self._beliefs[old - 1]
            del self._keys[:old], self._readings[:old], self._beliefs[:old]
