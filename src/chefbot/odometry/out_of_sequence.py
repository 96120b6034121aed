"""Out-of-sequence measurements: late readings give the same estimate as readings in order.

The last readings are kept in the order of their stamps, each with the belief after it. A late reading is
inserted at its stamp, and the readings after it are processed again (Bar-Shalom 2002, "Update with
out-of-sequence measurements in tracking: exact solution", compares this with formulas that avoid the
reprocessing).
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from typing import Generic, TypeVar

from chefbot.odometry.readings import Key, Reading, order

Belief = TypeVar("Belief")


class History(Generic[Belief]):
    """A history of beliefs over the last `horizon_ns` before the newest stamp; older ones are final.

    `fold(belief, reading)` must be a pure function that returns a new belief.
    """

    def __init__(self, fold: Callable[[Belief, Reading], Belief], start: Belief, horizon_ns: int) -> None:
        self._fold, self._base, self._horizon_ns = fold, start, horizon_ns
        self._keys: list[Key] = []
        self._readings: list[Reading] = []
        self._beliefs: list[Belief] = []

    @property
    def latest(self) -> Belief:
        """Belief after the newest reading."""
        return self._beliefs[-1] if self._beliefs else self._base

    @property
    def newest_ns(self) -> int | None:
        """Newest stamp, ns; None before the first reading."""
        return self._keys[-1][0] if self._keys else None

    def add(self, reading: Reading) -> bool:
        """Insert a reading at its stamp; return False if it is too old or a duplicate."""
        newest = self.newest_ns
        if newest is not None and reading.stamp_ns <= newest - self._horizon_ns:
            return False
        key = order(reading)
        first, end = bisect_left(self._keys, key), bisect_right(self._keys, key)
        at = first + bisect_left(self._readings[first:end], repr(reading), key=repr) if end > first else end
        if at < end and repr(self._readings[at]) == repr(reading):
            return False
        # Reprocess from the inserted reading on; this may raise, and until here nothing has changed
        beliefs = self._reprocessed(at, [reading, *self._readings[at:]])
        self._keys.insert(at, key)
        self._readings.insert(at, reading)
        self._beliefs[at:] = beliefs
        self._drop_expired()
        return True

    def _reprocessed(self, at: int, readings: list[Reading]) -> list[Belief]:
        """Return the beliefs after each of the readings, starting from the belief before index `at`."""
        belief, beliefs = self._beliefs[at - 1] if at else self._base, []
        for reading in readings:
            belief = self._fold(belief, reading)
            beliefs.append(belief)
        return beliefs

    def _drop_expired(self) -> None:
        expired = bisect_left(self._keys, (self._keys[-1][0] - self._horizon_ns + 1, -1))
        if expired:
            self._base = self._beliefs[expired - 1]
            del self._keys[:expired], self._readings[:expired], self._beliefs[:expired]
