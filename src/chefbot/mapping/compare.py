"""Quality of a map compared with the ground-truth floor plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import UNKNOWN, Grid

OCCUPIED_ABOVE = 65
"""Occupancy threshold in percent, as in map files."""
TOLERANCE = 1
"""Permitted offset of a wall in cells, including diagonals."""


@dataclass(frozen=True)
class MapQuality:
    """Ratios from 0 to 1; NaN where the denominator is zero.

    precision: of the map's occupied cells, those with a true one within TOLERANCE.
    recall: of the true occupied cells that are visible, those with an occupied cell of the map within
    TOLERANCE.
    explored: of the true free cells, those that are known in the map, free or occupied.
    """

    precision: float
    recall: float
    explored: float


def quality(grid: Grid, truth: Grid) -> MapQuality:
    """Return the quality of `grid`; size, origin and resolution of the grids may differ."""
    from scipy import ndimage  # imported late: it takes half a second

    # Only walls next to free cells can be seen
    free = (truth.cells >= 0) & (truth.cells <= OCCUPIED_ABOVE)
    visible = _occupied(truth) & ndimage.binary_dilation(free, np.ones((3, 3)))
    return MapQuality(
        _mean(_sample(_near_occupied(truth), truth, _centres(grid, _occupied(grid)), TOLERANCE)),
        _mean(_sample(_near_occupied(grid), grid, _centres(truth, visible), TOLERANCE)),
        _mean(_sample(grid.cells != UNKNOWN, grid, _centres(truth, free), 0)),
    )


def _occupied(grid: Grid) -> NDArray[np.bool_]:
    return grid.cells > OCCUPIED_ABOVE


def _near_occupied(grid: Grid) -> NDArray[np.bool_]:
    """Return the cells within TOLERANCE of an occupied one, on the grid padded by TOLERANCE on all sides."""
    from scipy import ndimage  # imported late: it takes half a second

    occupied = np.pad(_occupied(grid), TOLERANCE)
    if not occupied.any():
        return occupied
    return ndimage.distance_transform_cdt(~occupied, "chessboard") <= TOLERANCE


def _centres(grid: Grid, mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the centres (x, y) of the selected cells, (n, 2), metres."""
    row, column = np.nonzero(mask)
    return np.column_stack(
        [
            grid.origin_x + (column + 0.5) * grid.resolution,
            grid.origin_y + (row + 0.5) * grid.resolution,
        ]
    )


def _sample(
    mask: NDArray[np.bool_], grid: Grid, points: NDArray[np.float64], padding: int
) -> NDArray[np.bool_]:
    """Return the mask (the grid padded by `padding` cells) at the points; False outside."""
    cells = np.floor((points - (grid.origin_x, grid.origin_y)) / grid.resolution).astype(np.int64) + padding
    column, row = cells.T
    inside = (row >= 0) & (row < mask.shape[0]) & (column >= 0) & (column < mask.shape[1])
    values = np.zeros(len(points), dtype=np.bool_)
    values[inside] = mask[row[inside], column[inside]]
    return values


def _mean(hits: NDArray[np.bool_]) -> float:
    return float(hits.mean()) if len(hits) else math.nan
