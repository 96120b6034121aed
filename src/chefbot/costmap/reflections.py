"""Points of a scan that may be reflections of glass: a few neighbours with free space on both sides."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

MAX_STEP = 0.1
"""Maximum difference between the ranges of neighbouring points of one reflection, m."""
MIN_DEPTH = 0.3
"""Minimum distance from a reflection to what the beams beside it measure, m."""
MIN_POINTS = 3
"""Minimum number of points of a reflection."""
MAX_WIDTH = 0.5
"""Maximum angle that a reflection takes up, rad: wider ones are seen at other angles, too."""
MAX_DISTANCE = 4.0
"""Maximum distance of a reflection, m."""


MAX_HOLE = 2
"""Maximum number of invalid beams between neighbours: a scan without skew has none in some directions."""


@njit(cache=True, nogil=True)
def find_reflections(angles: NDArray[np.float64], ranges: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the first beam and the one after the last (m, 2) of what may be reflections of glass.

    angles, ranges: (n,) rad, m; a range of inf is no return, NaN is invalid. A reflection that lies across the first
    and the last beam is not found.
    """
    found = np.empty((ranges.shape[0] // MIN_POINTS + 1, 2), np.int64)
    count, first, last, points = 0, 0, -1, 0
    farthest, before = np.inf, np.nan
    for i in range(ranges.shape[0]):
        if np.isnan(ranges[i]):
            continue
        is_neighbour = last >= 0 and i - last <= MAX_HOLE + 1
        # neighbours are of one surface if their ranges differ little; two without a return are of none
        if is_neighbour and abs(ranges[i] - ranges[last]) <= MAX_STEP:
            farthest = max(farthest, ranges[i])
            points += 1
        else:
            # the surface from beam `first` to beam `last` has ended: is there free space on both sides?
            is_small = points >= MIN_POINTS and abs(angles[last] - angles[first]) <= MAX_WIDTH
            background = farthest + MIN_DEPTH
            is_free = before >= background and ranges[i] >= background  # false for NaN
            if is_neighbour and is_small and is_free and farthest <= MAX_DISTANCE:
                found[count] = first, last + 1
                count += 1
            before = ranges[last] if is_neighbour else np.nan
            first, points, farthest = i, 1, ranges[i]
        last = i
    return found[:count]
