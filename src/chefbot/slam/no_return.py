"""Detection of the range that a recording's laser reports for "no return".

Logs encode "no return" as a large number, which differs from laser to laser. A laser without a return repeats
one value, or a few close to each other, in many beams of many scans, and never measures anything beyond. The
ranges of surfaces change with every motion of the robot and become fewer with distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.slam.recorded_scan import RecordedScan

BIN = 0.02
"""Width of the histogram's bins, m: about the resolution of a laser."""
MIN_DENSITY_RATIO = 12.0
"""Minimum ratio of such a bin to the bins below it: rounding to 5 cm alone makes bins 2.5 times fuller."""
MIN_SHARE = 0.0005
"""Minimum share of all beams in such a bin."""
MIN_PLACES = 10
"""Minimum number of places it must occur at: while the robot stands, every surface repeats its range."""
BAND = 0.05
"""Relative width of the band of such values below the largest; some lasers encode several reasons."""
MARGIN = 0.0025
"""Relative amount by which noise may fall below the lowest of them."""
MAX_SHARE_BEYOND = 0.02
"""Maximum count beyond the band relative to the bin's; with more, something was measured there."""
MAX_MEASURED = 1000.0
"""Range that no laser of a ground robot measures, m: more than it means no return, whatever the other beams say."""
_PLACE_DISTANCE, _PLACE_ROTATION = 0.1, 0.1


class NoReturn(NamedTuple):
    """The lowest range in metres that means no return, and the share of all beams that have it or more."""

    min_range: float
    share: float


def detect_no_return(scans: Sequence[RecordedScan]) -> NoReturn | None:
    """Return the ranges that encode "no return" in a recording; None if no value stands out.

    Some lasers have several such values far from each other: below each one the next is searched for.
    """
    ranges = np.concatenate([scan.ranges for scan in scans])
    lowest, threshold = MAX_MEASURED, _find_threshold(scans, ranges, MAX_MEASURED)
    while threshold is not None:
        lowest, threshold = threshold, _find_threshold(scans, ranges, threshold)
    no_returns = ranges[ranges >= lowest]
    return NoReturn(float(no_returns.min()), len(no_returns) / len(ranges)) if no_returns.size else None


def _find_threshold(scans: Sequence[RecordedScan], ranges: NDArray[np.float32], limit: float) -> float | None:
    """Return the range from which on those below `limit` metres mean no return; None if no value stands out."""
    bins = np.floor(ranges[(ranges > 0.0) & (ranges < limit)] / BIN + 0.5).astype(np.int64)
    if bins.size == 0:
        return None
    # Histogram of all ranges; candidates are narrow spikes
    counts = np.bincount(bins)
    spikes = _spikes(counts, MIN_SHARE * len(ranges))
    # The largest spike with nothing measured beyond it
    last_spike = next((spike for spike in spikes[::-1] if _is_last(counts, spike)), None)
    if last_spike is None:
        return None
    # The smallest spike in the band below it
    first_spike = int(spikes[spikes >= last_spike * (1.0 - BAND)][0])
    threshold = float((first_spike - 0.5) * BIN - MARGIN * last_spike * BIN)
    # A standing robot repeats the ranges of surfaces: require several places
    return threshold if _count_places(scans, threshold, limit) >= MIN_PLACES else None


def _spikes(counts: NDArray[np.int64], min_count: float) -> NDArray[np.int64]:
    """Return, ascending, the bins with `min_count` or more beams that are much fuller than the bins below."""
    spikes = [
        spike for spike in np.flatnonzero(counts >= max(min_count, 1.0)) if _stands_out(counts, int(spike))
    ]
    return np.array(spikes, np.int64)


def _stands_out(counts: NDArray[np.int64], spike: int) -> bool:
    """Compare a bin with the mean of the bins from 80 to 95 % of its range."""
    below = counts[math.floor(0.8 * spike) : math.ceil((1.0 - BAND) * spike)]
    return below.size > 0 and counts[spike] >= MIN_DENSITY_RATIO * max(float(below.mean()), 1.0)


def _is_last(counts: NDArray[np.int64], spike: int) -> bool:
    """Return whether hardly any range was measured beyond the spike's band."""
    beyond = counts[math.ceil(spike * (1.0 + BAND)) :].sum()
    return bool(beyond <= MAX_SHARE_BEYOND * counts[spike])


def _count_places(scans: Sequence[RecordedScan], low: float, high: float) -> int:
    """Count the places of the robot where a scan has a range between two values, m."""
    places, last = 0, None
    for scan in scans:
        seen = (scan.ranges >= low) & (scan.ranges < high)
        if (last is None or _has_moved(last, scan.odom)) and bool(seen.any()):
            places, last = places + 1, scan.odom
    return places


def _has_moved(last: SE2, now: SE2) -> bool:
    motion = last.between(now)
    return math.hypot(motion.x, motion.y) >= _PLACE_DISTANCE or abs(motion.yaw) >= _PLACE_ROTATION
