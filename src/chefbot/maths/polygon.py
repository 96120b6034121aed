"""Simple polygons on a grid of cells: which cells lie inside or are touched, and where a straight line enters."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2

SAMPLES_PER_CELL = 4
"""Points per cell side along an edge, by which the cells that the edge touches are found."""


class GridGeometry(NamedTuple):
    """Where a grid of cells lies: side of a cell and outer corner of cell [0, 0], m; rows and columns."""

    resolution: float
    origin_x: float
    origin_y: float
    height: int
    width: int


def cells_inside(corners: NDArray[np.float64], grid: GridGeometry) -> NDArray[np.bool_]:
    """Return which cells (h, w) have their centre inside a polygon with `corners` (n, 2), m.

    A row's centre line changes from outside to inside and back at each edge that it crosses (even-odd rule).
    """
    x = grid.origin_x + (np.arange(grid.width) + 0.5) * grid.resolution
    y = grid.origin_y + (np.arange(grid.height) + 0.5) * grid.resolution
    inside = np.zeros((grid.height, grid.width), np.bool_)
    if not _overlaps(corners, grid):
        return inside
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        rows = np.flatnonzero((ay > y) != (by > y))
        if len(rows):
            crossing = ax + (y[rows] - ay) / (by - ay) * (bx - ax)
            inside[rows] ^= x[None, :] < crossing[:, None]
    return inside


def cells_touched(corners: NDArray[np.float64], grid: GridGeometry) -> NDArray[np.bool_]:
    """Return which cells (h, w) a polygon with `corners` (n, 2), m, covers or its edges pass through.

    So a polygon narrower than a cell has cells, too.
    """
    touched = cells_inside(corners, grid)
    if not _overlaps(corners, grid):
        return touched
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = math.ceil(math.hypot(*(b - a)) / grid.resolution * SAMPLES_PER_CELL) + 1
        points = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
        columns = np.floor((points[:, 0] - grid.origin_x) / grid.resolution)
        rows = np.floor((points[:, 1] - grid.origin_y) / grid.resolution)
        on_grid = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width)
        touched[rows[on_grid].astype(np.int64), columns[on_grid].astype(np.int64)] = True
    return touched


def _overlaps(corners: NDArray[np.float64], grid: GridGeometry) -> bool:
    """Return whether the bounding box of a polygon has a point on the grid."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    width, height = grid.width * grid.resolution, grid.height * grid.resolution
    return bool(
        high[0] >= grid.origin_x
        and low[0] <= grid.origin_x + width
        and high[1] >= grid.origin_y
        and low[1] <= grid.origin_y + height
    )


def contains(corners: NDArray[np.float64], x: float, y: float) -> bool:
    """Return whether a point (m) lies inside a polygon with `corners` (n, 2), by the even-odd rule."""
    ax, ay = corners.T
    bx, by = np.roll(corners, -1, axis=0).T
    straddles = (ay > y) != (by > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = ax + (y - ay) / (by - ay) * (bx - ax)
    return bool(np.count_nonzero(straddles & (x < crossing)) % 2)


def distance_ahead(corners: NDArray[np.float64], pose: SE2) -> float:
    """Return the distance (m) straight ahead of a pose at which a polygon with `corners` (n, 2) begins.

    0 inside it, inf if the straight line ahead misses it.
    """
    if contains(corners, pose.x, pose.y):
        return 0.0
    # corners in the frame of the pose: the line ahead is the positive x axis
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    dx, dy = corners[:, 0] - pose.x, corners[:, 1] - pose.y
    x, y = c * dx + s * dy, c * dy - s * dx
    next_x, next_y = np.roll(x, -1), np.roll(y, -1)
    crosses = (y > 0.0) != (next_y > 0.0)
    at = x[crosses] - y[crosses] * (next_x - x)[crosses] / (next_y - y)[crosses]
    ahead = at[at >= 0.0]
    return float(ahead.min()) if len(ahead) else math.inf
