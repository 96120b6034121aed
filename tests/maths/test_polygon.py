"""Polygons on grids, compared with shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from chefbot.maths.polygon import GridGeometry, cells_inside, cells_touched, contains, distance_ahead
from chefbot.maths.se2 import SE2

GRID = GridGeometry(0.1, -1.0, -0.5, 23, 31)
NEAR = 1e-6
"""Distance from an edge within which a point may count as inside or outside, m."""


@st.composite
def polygons(draw: st.DrawFn) -> np.ndarray:
    """Return a star-shaped polygon, convex or not, on the grid, across its edge, or outside it."""
    count = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(0.02, 1.5), min_size=count, max_size=count))
    angles = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False) + draw(st.floats(0.0, 6.0))
    centre = draw(st.floats(-2.0, 3.0)), draw(st.floats(-2.0, 3.0))
    return np.array(centre) + np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


def centres() -> np.ndarray:
    rows, columns = np.indices((GRID.height, GRID.width))
    x = GRID.origin_x + (columns + 0.5) * GRID.resolution
    return np.stack([x, GRID.origin_y + (rows + 0.5) * GRID.resolution], axis=-1)


@given(polygons())
def test_cells_inside_have_their_centre_in_the_polygon(corners: np.ndarray) -> None:
    polygon, points = shapely.Polygon(corners), shapely.points(centres())
    clear = shapely.distance(polygon.boundary, points) > NEAR
    expected = shapely.contains(polygon, points)
    assert np.array_equal(cells_inside(corners, GRID)[clear], expected[clear])
    assert np.array_equal(cells_inside(corners[::-1], GRID)[clear], expected[clear])


@given(polygons())
def test_touched_cells_meet_the_polygon_and_no_part_is_missed(corners: np.ndarray) -> None:
    polygon, touched = shapely.Polygon(corners), cells_touched(corners, GRID)
    low = centres() - GRID.resolution / 2.0
    cells = shapely.box(
        low[..., 0], low[..., 1], low[..., 0] + GRID.resolution, low[..., 1] + GRID.resolution
    )
    common = shapely.area(shapely.intersection(cells, polygon))
    assert (shapely.distance(cells, polygon)[touched] < NEAR).all()
    # only a corner of a cell between two points on an edge may be missed
    assert (common[~touched] < GRID.resolution**2 / 8.0).all()
    assert (cells_inside(corners, GRID) <= touched).all()


def test_a_polygon_narrower_than_a_cell_has_cells() -> None:
    line = np.array([(0.0, 0.51), (1.0, 0.51), (1.0, 0.52), (0.0, 0.52)])
    assert not cells_inside(line, GRID).any()
    assert cells_touched(line, GRID).sum() in (10, 11)


@given(polygons(), st.floats(-2.0, 3.0), st.floats(-2.0, 3.0), st.floats(-4.0, 4.0))
def test_the_distance_ahead_is_that_of_the_first_edge(
    corners: np.ndarray, x: float, y: float, yaw: float
) -> None:
    polygon, point = shapely.Polygon(corners), shapely.Point(x, y)
    assume(polygon.boundary.distance(point) > NEAR)
    found = distance_ahead(corners, SE2(x, y, yaw))
    assert contains(corners, x, y) == polygon.contains(point) == (found == 0.0)
    if found == 0.0:
        return
    ray = shapely.LineString([(x, y), (x + 20.0 * math.cos(yaw), y + 20.0 * math.sin(yaw))])
    meets = polygon.intersection(ray)
    if math.isfinite(found):
        assert point.distance(polygon) <= found + NEAR
        at = shapely.Point(x + found * math.cos(yaw), y + found * math.sin(yaw))
        assert polygon.boundary.distance(at) < 1e-5
        if not meets.is_empty:
            assert found == pytest.approx(point.distance(meets), abs=1e-5)
    else:
        assert meets.length < 1e-5
