"""Changes of a map by a person: strokes of a brush, a crop, a rotation."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.mapping.image_format import MapFormatError
from chefbot.mapping.map_format import on_axes_of_frame
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

MIN_SIDE = 10
"""Minimum number of rows and columns of a cropped map."""
EDGE = 1e-6
"""Part of a cell by which an edge may miss the border of two cells."""


def with_stroke(grid: Grid, points: NDArray[np.float64], width: float, value: int) -> Grid:
    """Return the map with a stroke along `points` (n, 2), m, in cells whose centres are within half its width.

    value: of the cells, as in an occupancy grid. A stroke of one point is a disc, and the narrowest is a cell wide.
    """
    cells = np.array(grid.cells)
    pixels = (points - (grid.origin_x, grid.origin_y)) / grid.resolution - 0.5
    radius = max(0.5 * width / grid.resolution, 0.5)
    ends = pixels[1:] if len(pixels) > 1 else pixels
    for begin, end in zip(pixels, ends, strict=False):
        _draw_segment(cells, begin, end, radius, value)
    return Grid(cells, grid.resolution, grid.origin_x, grid.origin_y)


def _draw_segment(
    cells: NDArray[np.int8],
    begin: NDArray[np.float64],
    end: NDArray[np.float64],
    radius: float,
    value: int,
) -> None:
    """Fill the cells within `radius` of a segment between two points (column, row), all in cells."""
    # the window of cells around the segment
    low = np.maximum(np.floor(np.minimum(begin, end) - radius), 0).astype(int)
    high = np.minimum(np.ceil(np.maximum(begin, end) + radius) + 1, cells.shape[::-1]).astype(int)
    if (low >= high).any():
        return
    column, row = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    distance = _distance_to_segment(column - begin[0], row - begin[1], end - begin)
    cells[low[1] : high[1], low[0] : high[0]][distance <= radius] = value


def _distance_to_segment(
    offset_x: NDArray[np.float64], offset_y: NDArray[np.float64], along: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distances of points, as offsets from its beginning, to a segment that leads along a vector."""
    # distance of each cell to the nearest point of the segment
    length = float(along @ along)
    share = (offset_x * along[0] + offset_y * along[1]) / length if length > 0.0 else np.zeros(offset_x.shape)
    share = np.clip(share, 0.0, 1.0)
    return np.hypot(offset_x - share * along[0], offset_y - share * along[1])


def cropped(grid: Grid, low: tuple[float, float], high: tuple[float, float]) -> Grid:
    """Return the part of the map between two corners (x, y), m; whole cells, and nothing outside the map.

    Raises MapFormatError if too little is left.
    """
    rows = _cells_between(low[1], high[1], grid.origin_y, grid)
    columns = _cells_between(low[0], high[0], grid.origin_x, grid)
    cells = np.ascontiguousarray(grid.cells[rows, columns])
    if min(cells.shape) < MIN_SIDE:
        raise MapFormatError(f"the map would have fewer than {MIN_SIDE} rows or columns of cells")
    x = grid.origin_x + columns.start * grid.resolution
    return Grid(cells, grid.resolution, x, grid.origin_y + rows.start * grid.resolution)


def _cells_between(low: float, high: float, origin: float, grid: Grid) -> slice:
    """Return the rows or columns that lie, at least in part, between two coordinates, m."""
    first = math.floor((low - origin) / grid.resolution + EDGE)
    behind = math.ceil((high - origin) / grid.resolution - EDGE)
    return slice(max(0, first), max(0, behind))


def rotated(grid: Grid, yaw: float) -> Grid:
    """Return the map turned about the origin of its frame by `yaw`, rad; every occupied cell is kept.

    Raises MapFormatError if it becomes too large.
    """
    corner = SE2(0.0, 0.0, yaw) @ SE2(grid.origin_x, grid.origin_y, 0.0)
    return on_axes_of_frame(grid.cells, grid.resolution, (corner.x, corner.y, yaw), "the map")
