"""Tests the distance field of the floor against geometry: distances, gradients, lines and rays."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, distance, points
from shapely.affinity import rotate, translate
from shapely.geometry import box
from shapely.ops import unary_union

from chefbot.sim.people.distance_field import (
    away_from_obstacle,
    distance_at,
    free_range,
    is_visible,
    line_is_clear,
    lower_to_boxes,
)

CELL, ROWS, COLUMNS, REACH = 0.05, 60, 80, 1.5
FRAME = np.array([-1.0, -0.5, CELL])
INSIDE = st.tuples(st.floats(-0.9, 2.9), st.floats(-0.4, 2.4))
BOXES = st.lists(
    st.tuples(
        *[st.floats(-0.8, 2.8), st.floats(-0.3, 2.3)],
        *[st.floats(0.1, 0.6)] * 2,
        st.floats(-3.0, 3.0),
        st.sampled_from([0.0, 0.1, 0.3]),
    ),
    min_size=1,
    max_size=3,
)
POST = (0.6, 1.0, 0.1, 0.1, 0.0, 0.0)
QUICK = settings(max_examples=25)


def shape_of(x, y, half_x, half_y, yaw, radius):
    """Return a box as a polygon, with its rounding."""
    flat = rotate(box(-half_x, -half_y, half_x, half_y), yaw, origin=(0, 0), use_radians=True)
    return translate(flat, x, y).buffer(radius, quad_segs=64)


def field_of(boxes) -> np.ndarray:
    field = np.full((ROWS, COLUMNS), REACH, np.float32)
    rows = [(x, y, hx, hy, math.cos(yaw), math.sin(yaw), radius) for x, y, hx, hy, yaw, radius in boxes]
    lower_to_boxes(field, FRAME, np.array(rows, float).reshape(-1, 7), REACH)
    return field


def slope(along_x: float, along_y: float, at: float = 1.0) -> np.ndarray:
    """Return a field that is a plane."""
    x, y = CELL * (np.arange(COLUMNS) + 0.5) - 1.0, CELL * (np.arange(ROWS) + 0.5) - 0.5
    return np.asarray(at + along_x * x[None] + along_y * y[:, None], np.float32)


@QUICK
@example([(1.0, 1.0, 0.6, 0.1, math.pi / 2, 0.0)])
@example([(1.0, 1.0, 0.1, 0.6, math.pi / 2, 0.0)])
@given(BOXES)
def test_cells_hold_the_distance_to_the_nearest_box(boxes) -> None:
    x, y = FRAME[0] + (np.arange(COLUMNS) + 0.5) * CELL, FRAME[1] + (np.arange(ROWS) + 0.5) * CELL
    centres = points(*np.meshgrid(x[::4], y[::4]))
    expected = np.min([distance(shape_of(*one), centres) for one in boxes], axis=0)
    assert field_of(boxes)[::4, ::4] == pytest.approx(np.minimum(expected, REACH), abs=2e-3)


@settings(max_examples=25)
@given(BOXES)
def test_boxes_only_lower_the_field_and_in_any_order(boxes) -> None:
    field = field_of(boxes)
    assert np.array_equal(field, field_of(boxes[::-1]))
    lower_to_boxes(field, FRAME, np.empty((0, 7)), REACH)
    assert np.array_equal(field, field_of(boxes))
    assert (field <= field_of(boxes[:1])).all() and (field >= 0.0).all()


@settings(max_examples=40)
@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), INSIDE)
def test_between_cells_the_field_is_interpolated(along_x: float, along_y: float, point) -> None:
    x, y = point
    found = distance_at(slope(along_x, along_y, 2.0), FRAME, x, y)
    assert found == pytest.approx(2.0 + along_x * x + along_y * y, abs=1e-5)


@settings(max_examples=40)
@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))
def test_outside_the_grid_there_is_no_room(x: float, y: float) -> None:
    inside = -1.0 + CELL / 2 <= x < 3.0 - CELL / 2 and -0.5 + CELL / 2 <= y < 2.5 - CELL / 2
    assert (distance_at(np.full((ROWS, COLUMNS), REACH, np.float32), FRAME, x, y) > 0.0) == inside


@settings(max_examples=40)
@given(st.floats(-math.pi, math.pi), INSIDE)
def test_away_is_the_direction_of_steepest_distance(bearing: float, point) -> None:
    assume(-0.85 < point[0] < 2.85 and -0.35 < point[1] < 2.35)
    ux, uy = math.cos(bearing), math.sin(bearing)
    found = away_from_obstacle(slope(0.5 * ux, 0.5 * uy, 3.0), FRAME, *point)
    assert found == (pytest.approx(ux, abs=1e-3), pytest.approx(uy, abs=1e-3))


def test_on_level_ground_no_direction_leads_away() -> None:
    assert away_from_obstacle(slope(0.0, 0.0), FRAME, 1.0, 1.0) == (0.0, 0.0)


@QUICK
@example([POST], (-0.5, 1.0), (2.5, 1.0), 0.1)
@example([POST], (-0.5, 1.2), (2.5, 1.2), 0.15)
@given(BOXES, INSIDE, INSIDE, st.floats(0.05, 0.5))
def test_a_clear_line_keeps_its_margin(boxes, start, end, margin: float) -> None:
    field = field_of(boxes)
    free = [
        distance_at(field, FRAME, *(np.array(start) + t * np.subtract(end, start)))
        for t in np.linspace(0.0, 1.0, 200)
    ]
    kept = min(margin, free[0])
    if line_is_clear(field, FRAME, *start, *end, margin):
        assert min(free) >= kept - CELL / 2 - 2e-3
    else:
        assert min(free) < kept + 2e-3


@QUICK
@given(BOXES, INSIDE, INSIDE)
def test_what_stands_between_two_points_hides_them(boxes, start, end) -> None:
    line, solid = LineString([start, end]), unary_union([shape_of(*one) for one in boxes])
    visible = is_visible(field_of(boxes), FRAME, *start, *end)
    if line.intersection(solid).length > 4.0 * CELL:
        assert not visible
    elif line.distance(solid) > 2.0 * CELL:
        assert visible


def test_points_outside_the_grid_are_not_visible() -> None:
    field = np.full((ROWS, COLUMNS), REACH, np.float32)
    assert is_visible(field, FRAME, 0.0, 0.0, 2.0, 2.0)
    assert not is_visible(field, FRAME, 0.0, 0.0, 9.0, 2.0)
    assert not is_visible(field, FRAME, -9.0, 0.0, 2.0, 2.0)


@QUICK
@example([POST], (-0.3, 1.0), 0.0, 2.0)
@given(BOXES, INSIDE, st.floats(-math.pi, math.pi), st.floats(0.1, 2.0))
def test_a_ray_ends_at_the_first_box(boxes, start, bearing: float, limit: float) -> None:
    solid = unary_union([shape_of(*one) for one in boxes])
    assume(solid.distance(Point(start)) > CELL)
    ux, uy = math.cos(bearing), math.sin(bearing)
    end = (start[0] + limit * ux, start[1] + limit * uy)
    assume(-0.95 < end[0] < 2.95 and -0.45 < end[1] < 2.45)
    found = free_range(field_of(boxes), FRAME, *start, ux, uy, limit)
    grown, shrunk = solid.buffer(CELL), solid.buffer(-CELL)
    ray, at = LineString([start, end]), Point(start)
    assert found <= limit
    if not ray.intersects(grown):
        assert found == limit
    else:
        assert found >= at.distance(ray.intersection(grown)) - CELL
    if ray.intersects(shrunk):
        assert found <= at.distance(ray.intersection(shrunk)) + CELL
