"""Which ranges of a recording stand for "nothing was in reach": logs write them as a large number, each its own.

A laser that sees nothing repeats one value, or a few next to each other, in many beams of many scans, and nothing is
ever measured beyond. The ranges of surfaces change with every step of the robot and grow fewer with distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.slam.carmen import CarmenScan

BIN = 0.02
"""Width in metres of the histogram's bins: about what a laser resolves."""
TIMES_DENSER = 12.0
"""How much fuller than its surroundings below a bin must be: rounding to 5 cm alone makes bins 2.5 times fuller."""
LEAST_SHARE = 0.0005
"""Of all beams that such a bin must hold."""
LEAST_SCANS = 10
"""From different places that it must come from: while the robot stands, every surface repeats its range."""
BAND = 0.05
"""Share of the largest such value within which the others lie, as of lasers that tell several reasons apart."""
MARGIN = 0.0025
"""Share by which noise may fall below the lowest of them."""
MOST_BEYOND = 0.02
"""Of a bin's count that may lie beyond the band: more, and something real was measured there."""
_PLACE_M, _PLACE_RAD = 0.1, 0.1


class NoReturn(NamedTuple):
    """Ranges of `least` metres and more are no returns; they are `share` of all beams."""

    least: float
    share: float


def find_no_return(scans: Sequence[CarmenScan]) -> NoReturn | None:
    """What the recording's laser writes when nothing is in reach; None where no value stands out."""
    ranges = np.concatenate([scan.ranges for scan in scans])
    bins = np.floor(ranges[ranges > 0.0] / BIN + 0.5).astype(np.int64)
    if bins.size == 0:
        return None
    counts = np.bincount(bins)
    spikes = _spikes(counts, LEAST_SHARE * len(ranges))
    top = next((spike for spike in spikes[::-1] if _is_at_the_end(counts, spike)), None)
    if top is None:
        return None
    low = int(spikes[spikes >= top * (1.0 - BAND)][0])
    edge = (low - 0.5) * BIN - MARGIN * top * BIN
    if _places_that_see(scans, edge) < LEAST_SCANS:
        return None
    taken = ranges[ranges >= edge]
    return NoReturn(float(taken.min()), len(taken) / len(ranges))


def _spikes(counts: NDArray[np.int64], least: float) -> NDArray[np.int64]:
    """Bins, ascending, that hold at least `least` beams and are far fuller than those of the fifth below them."""
    found = [spike for spike in np.flatnonzero(counts >= max(least, 1.0)) if _stands_out(counts, int(spike))]
    return np.array(found, np.int64)


def _stands_out(counts: NDArray[np.int64], spike: int) -> bool:
    """Against the mean of the bins from 80 to 95 % of its range."""
    below = counts[math.floor(0.8 * spike) : math.ceil((1.0 - BAND) * spike)]
    return below.size > 0 and counts[spike] >= TIMES_DENSER * max(float(below.mean()), 1.0)


def _is_at_the_end(counts: NDArray[np.int64], spike: int) -> bool:
    """Nothing to speak of was measured beyond its band."""
    beyond = counts[math.ceil(spike * (1.0 + BAND)) :].sum()
    return bool(beyond <= MOST_BEYOND * counts[spike])


def _places_that_see(scans: Sequence[CarmenScan], edge: float) -> int:
    """At how many places of the robot a scan has a range of `edge` metres or more."""
    places, last = 0, None
    for scan in scans:
        if (last is None or _elsewhere(last, scan.odom)) and bool((scan.ranges >= edge).any()):
            places, last = places + 1, scan.odom
    return places


def _elsewhere(last: SE2, now: SE2) -> bool:
    moved = last.between(now)
    return math.hypot(moved.x, moved.y) >= _PLACE_M or abs(moved.yaw) >= _PLACE_RAD
