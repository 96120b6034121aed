"""The grid of a submap: mean surface points for refinement and a likelihood field for search.

The likelihood field is the lookup table of Olson, Real-Time Correlative Scan Matching, ICRA 2009: each cell holds
the value of a Gaussian about the nearest surface point. The means are those of grid cells as in GMapping.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.slam.cell_bounds import EMPTY_BOUNDS, cells_of

CELL = 0.1
"""Side of a cell, m."""
SIGMA = 0.1
"""Standard deviation of the likelihood field, m."""
FIELD_MAX = 255
_RADIUS = 3
"""Reach of the Gaussian around a point, cells."""
_SPARE_CELLS = 40
"""Cells beyond what is needed when the grid grows."""
_EMPTY = -1
_TABLE_STEPS = 32.0
"""Entries of the Gaussian's table per squared cell."""


def _gaussian_table() -> NDArray[np.uint8]:
    """Return the field's value by squared distance in cells, in steps of 1 / _TABLE_STEPS."""
    squared = (np.arange(int(2 * (_RADIUS + 0.5) ** 2 * _TABLE_STEPS) + 2) + 0.5) / _TABLE_STEPS
    return np.round(FIELD_MAX * np.exp(-0.5 * (CELL / SIGMA) ** 2 * squared)).astype(np.uint8)


_TABLE = _gaussian_table()


class SurfaceGrid:
    """Surface points of several scans in the frame of a submap; cells of CELL m.

    field: (height, width) uint8, FIELD_MAX on a surface. slot: (height, width) int32, index of the cell's mean or
    -1. totals: (m, 3) float32, sum of x and y (m) of the points of a cell and their number.
    """

    def __init__(self, max_cells: int) -> None:
        self._max_cells = max_cells
        self._bounds = EMPTY_BOUNDS
        self.field = np.zeros((0, 0), np.uint8)
        self.slot = np.zeros((0, 0), np.int32)
        self.totals = np.zeros((256, 3), np.float32)
        self._used = 0

    @property
    def origin(self) -> NDArray[np.float64]:
        """Corner (2,) of the first cell in m."""
        return self._bounds.begin.astype(np.float64) * CELL

    def add(self, points: NDArray[np.float32], pose: NDArray[np.float64]) -> None:
        """Insert points (n, 2) taken at `pose` (3,) in the frame of the grid."""
        if not len(points):
            return
        placed = transformed(points, pose)
        cells = cells_of(placed / CELL)
        self._grow(cells.min(axis=0) - _RADIUS, cells.max(axis=0) + _RADIUS)
        if self._used + len(points) > len(self.totals):
            more = np.zeros((len(self.totals) + len(points), 3), np.float32)
            self.totals = np.concatenate([self.totals, more])
        self._used = _insert(placed, self.origin, self.field, self.slot, self.totals, self._used, _TABLE)

    def _grow(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        if self._bounds.contains(low, high):
            return
        bounds = self._bounds.expanded(low, high, np.full(2, _SPARE_CELLS)).check_size(self._max_cells)
        self.field = self._bounds.copied_into(self.field, bounds)
        # Slots are shifted by one while copying, since new cells are zeros
        self.slot = self._bounds.copied_into(self.slot + 1, bounds) + _EMPTY
        self._bounds = bounds


def transformed(points: NDArray[np.float32], pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transform points (n, 2) by a pose (3,): R(yaw) p + t."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y = points[:, 0].astype(np.float64), points[:, 1].astype(np.float64)
    return np.column_stack([c * x - s * y + pose[0], s * x + c * y + pose[1]])


@njit(cache=True, nogil=True)
def _insert(points, origin, field, slot, totals, used, table):  # type: ignore[no-untyped-def]
    """Add points (n, 2), m, to the means and to the field; return the number of slots in use."""
    for i in range(len(points)):
        x, y = (points[i, 0] - origin[0]) / CELL, (points[i, 1] - origin[1]) / CELL
        column, row = int(x), int(y)
        # Mean of the cell
        k = slot[row, column]
        if k < 0:
            k = used
            slot[row, column] = k
            used += 1
        totals[k, 0] += np.float32(points[i, 0])
        totals[k, 1] += np.float32(points[i, 1])
        totals[k, 2] += np.float32(1.0)
        # Gaussian about the point, at the centres of the cells around
        for r in range(row - _RADIUS, row + _RADIUS + 1):
            for c in range(column - _RADIUS, column + _RADIUS + 1):
                dx, dy = c + 0.5 - x, r + 0.5 - y
                value = table[int((dx * dx + dy * dy) * _TABLE_STEPS)]
                if value > field[r, c]:
                    field[r, c] = value
    return used
