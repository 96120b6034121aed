"""Grids of maxima of a likelihood field: upper bounds for branch and bound.

Hess et al., Real-Time Loop Closure in 2D LIDAR SLAM, ICRA 2016, section V: a cell of level k holds the maximum of
the field over the 2^k x 2^k cells that begin there.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

LEVELS = 6
"""Number of levels above the field itself: blocks of 2^LEVELS cells."""


def field_pyramid(field: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the maxima (LEVELS + 1, height + m, width + m) of a field, m = 2^LEVELS.

    Level 0 is the field with m empty rows and columns before it: blocks may begin ahead of the first cell.
    """
    margin = 1 << LEVELS
    levels = np.zeros((LEVELS + 1, field.shape[0] + margin, field.shape[1] + margin), np.uint8)
    levels[0, margin:, margin:] = field
    for level in range(LEVELS):
        _double(levels[level], levels[level + 1], 1 << level)
    return levels


@njit(cache=True, nogil=True)
def _double(small, large, size):  # type: ignore[no-untyped-def]
    """Write the maxima over blocks of 2 * size cells, from those over blocks of size cells."""
    height, width = small.shape
    for row in range(height):
        below = min(row + size, height - 1)
        for column in range(width):
            right = min(column + size, width - 1)
            first = max(small[row, column], small[row, right])
            large[row, column] = max(first, max(small[below, column], small[below, right]))
