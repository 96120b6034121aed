"""Strokes, crops and rotations of a map, against their plain definitions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import label

from chefbot.mapping.image_format import MapFormatError
from chefbot.mapping.map_changes import MIN_SIDE, cropped, rotated, with_stroke
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import SE2

COORDINATES = st.floats(-2.0, 5.0)


def empty(value: int = FREE) -> Grid:
    """A map of 3 m by 2 m that begins at (-1, 0.5)."""
    return Grid(np.full((40, 60), value, np.int8), 0.05, -1.0, 0.5)


def centres(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    x = grid.origin_x + (np.arange(grid.width) + 0.5) * grid.resolution
    y = grid.origin_y + (np.arange(grid.height) + 0.5) * grid.resolution
    return np.meshgrid(x, y)[0], np.meshgrid(x, y)[1]


@given(st.lists(st.tuples(COORDINATES, COORDINATES), min_size=1, max_size=4), st.floats(0.06, 1.0))
@pytest.mark.slow
def test_a_stroke_fills_what_is_near_its_line(corners: list[tuple[float, float]], width: float) -> None:
    grid, points = empty(), np.array(corners)
    drawn = with_stroke(grid, points, width, OCCUPIED)
    x, y = centres(grid)
    distance = np.full(x.shape, np.inf)
    for begin, end in zip(points, points[1:] if len(points) > 1 else points, strict=False):
        shares = np.linspace(0.0, 1.0, 400)[:, None, None]
        line = begin[:, None, None, None] + shares * (end - begin)[:, None, None, None]
        distance = np.minimum(distance, np.hypot(x - line[0], y - line[1]).min(axis=0))
    assert (drawn.cells[distance < width / 2 - 0.02] == OCCUPIED).all()
    assert (drawn.cells[distance > width / 2 + 0.02] == FREE).all()
    assert (grid.cells == FREE).all(), "the map that was given stays as it is"


def test_the_narrowest_stroke_closes_a_line() -> None:
    drawn = with_stroke(empty(), np.array([[0.0, 0.5], [0.0, 2.5]]), 0.0, OCCUPIED)
    assert (drawn.cells == OCCUPIED).any(axis=1).all()
    erased = with_stroke(drawn, np.array([[0.0, 0.5], [0.0, 2.5]]), 0.2, UNKNOWN)
    assert not (erased.cells == OCCUPIED).any() and (erased.cells == UNKNOWN).any()


@given(COORDINATES, COORDINATES, COORDINATES, COORDINATES)
def test_a_crop_keeps_each_cell_where_it_was(x: float, y: float, other_x: float, other_y: float) -> None:
    grid = empty()
    grid.cells[:] = np.arange(grid.cells.size).reshape(grid.cells.shape) % 101
    low, high = (min(x, other_x), min(y, other_y)), (max(x, other_x), max(y, other_y))
    try:
        part = cropped(grid, low, high)
    except MapFormatError:
        wide = min(high[0], 2.0) - max(low[0], -1.0) if high[0] > low[0] else 0.0
        tall = min(high[1], 2.5) - max(low[1], 0.5)
        assert min(wide, tall) < MIN_SIDE * grid.resolution + 1e-9
        return
    for row, column in ((0, 0), (part.height - 1, part.width - 1)):
        assert part.cells[row, column] == grid.at(*part.centre(row, column))
    assert part.origin_x <= max(low[0], -1.0) + 1e-6 and part.origin_y <= max(low[1], 0.5) + 1e-6
    assert part.origin_x + part.width * 0.05 >= min(high[0], 2.0) - 1e-6


@given(st.floats(-math.pi, math.pi))
def test_a_turned_map_keeps_every_wall(yaw: float) -> None:
    grid = empty(UNKNOWN)
    grid.cells[[0, -1], :] = grid.cells[:, [0, -1]] = OCCUPIED
    turned = rotated(grid, yaw)
    rows, columns = np.nonzero(grid.cells == OCCUPIED)
    walls = np.column_stack([grid.origin_x + (columns + 0.5) * 0.05, grid.origin_y + (rows + 0.5) * 0.05])
    for x, y in SE2(0.0, 0.0, yaw).apply(walls):
        assert turned.at(x, y) == OCCUPIED


def test_a_crop_of_nothing_is_refused() -> None:
    with pytest.raises(MapFormatError, match="fewer than 10 rows"):
        cropped(empty(), (0.0, 1.0), (0.1, 2.0))


@given(st.floats(-math.pi, math.pi), st.booleans())
def test_a_turned_diagonal_wall_has_no_hole(yaw: float, falling: bool) -> None:
    """Its cells touch at their corners, and so do those of the turned one: all are one piece."""
    cells = np.eye(60, dtype=np.int8) * np.int8(OCCUPIED)
    turned = rotated(Grid(cells[:, ::-1] if falling else cells, 0.05, 0.0, 0.0), yaw)
    _, pieces = label(turned.cells == OCCUPIED, np.ones((3, 3)))
    assert pieces == 1
