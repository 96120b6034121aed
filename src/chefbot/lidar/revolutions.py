"""Samples of a rotating lidar, collected to whole revolutions."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MAX_SAMPLES = 100_000
"""Samples without the end of a revolution after which they are discarded: no lidar takes so many in one."""


class Samples(NamedTuple):
    """Samples in the order in which they were taken.

    bearings: (n,) rad in [-pi, pi), counter-clockwise from the sensor's x axis. ranges: (n,) m, inf where nothing
    was in range. times_ns: (n,) at which each was taken.
    """

    bearings: NDArray[np.float64]
    ranges: NDArray[np.float64]
    times_ns: NDArray[np.int64]

    def part(self, start: int, end: int) -> Samples:
        """Return the samples from an index up to but without another."""
        return Samples(self.bearings[start:end], self.ranges[start:end], self.times_ns[start:end])


def bearings_of(clockwise: NDArray[np.float64], zero: float) -> NDArray[np.float64]:
    """Return bearings in [-pi, pi) of angles, rad, that count clockwise as seen from above.

    zero: bearing of the angle 0, rad.
    """
    return np.mod(zero - clockwise + math.pi, 2.0 * math.pi) - math.pi


class RevolutionAssembler:
    """Joins samples to revolutions from bearing pi down to -pi, as lidars that rotate clockwise take them.

    The samples before the first beginning of a revolution are left out.
    """

    def __init__(self) -> None:
        self._parts: list[Samples] = []
        self._last = 0.0
        self._begun = self._passed_front = False

    def push(self, samples: Samples) -> list[Samples]:
        """Return the revolutions that these samples end."""
        bearings = samples.bearings
        if not len(bearings):
            return []
        # a bearing that jumps up by more than half a revolution begins one, once half of the one before is over:
        # angles that depend on the range may step back
        before = np.concatenate(([self._last], bearings[:-1]))
        self._last = float(bearings[-1])
        revolutions, start = [], 0
        for begin in np.flatnonzero(bearings - before > math.pi).tolist():
            self._append(samples, start, begin)
            start = begin
            if self._passed_front:
                revolutions += [_joined(self._parts)] if self._begun else []
                self._parts, self._begun, self._passed_front = [], True, False
        self._append(samples, start, len(bearings))
        if sum(len(part.bearings) for part in self._parts) > MAX_SAMPLES:
            self.clear()
        return revolutions

    def clear(self) -> None:
        """Discard an unfinished revolution, as the next samples do not continue it."""
        self._parts, self._begun, self._passed_front = [], False, False

    def _append(self, samples: Samples, start: int, end: int) -> None:
        if end > start:
            part = samples.part(start, end)
            self._parts.append(part)
            self._passed_front |= bool((np.abs(part.bearings) < math.pi / 2.0).any())


def _joined(parts: list[Samples]) -> Samples:
    return Samples(
        np.concatenate([part.bearings for part in parts]),
        np.concatenate([part.ranges for part in parts]),
        np.concatenate([part.times_ns for part in parts]),
    )
