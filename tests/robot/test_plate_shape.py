"""Shapes of plates against the polygons of their edges, with shapely as the judge."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon

from chefbot.maths.outline import Outline, points
from chefbot.robot.plate_shape import RectangularPlate, RoundPlate

SIDES = st.integers(50, 1000).map(lambda k: k / 1000.0)
ROUND = st.builds(RoundPlate, SIDES)
RECTANGULAR = st.builds(RectangularPlate, SIDES, SIDES, SIDES)
PLATES = st.one_of(ROUND, RECTANGULAR)
PLACES = st.integers(-1200, 1200).map(lambda k: k / 1000.0)
CLOSE = 2e-3
"""Distance up to which the polygon of a circle is one, m."""


def polygon(plate: RoundPlate | RectangularPlate) -> Polygon:
    return Polygon(points(plate.loop(), 1e-4))


def extent(plate: RoundPlate | RectangularPlate, a: tuple[float, float], b: tuple[float, float]) -> float:
    """Return the length of a straight line inside a plate, m."""
    return float(polygon(plate).intersection(LineString([a, b])).length)


@settings(max_examples=40)
@given(PLATES)
def test_the_edge_reaches_the_dimensions_of_the_plate(plate: RoundPlate | RectangularPlate) -> None:
    left, low, right, high = polygon(plate).bounds
    assert (left, right) == pytest.approx((-plate.back, plate.front), abs=CLOSE)
    assert (low, high) == pytest.approx((-plate.half_width, plate.half_width), abs=CLOSE)
    assert polygon(plate).exterior.is_ccw


def test_the_edge_encloses_the_area_of_the_shape() -> None:
    assert Outline(RoundPlate(0.2).loop()).moments().area == pytest.approx(math.pi * 0.04)
    moments = Outline(RectangularPlate(0.3, 0.1, 0.2).loop()).moments()
    assert moments.area == pytest.approx(0.4 * 0.4)
    assert (moments.x / moments.area, moments.y) == pytest.approx((0.1, 0.0)), "its middle is before the axle"


@settings(max_examples=40)
@given(PLATES, PLACES)
def test_the_width_at_a_place_is_that_of_the_polygon(plate: RoundPlate | RectangularPlate, x: float) -> None:
    half = plate.half_width_at(x)
    assert half >= 0.0
    if min(abs(x - plate.front), abs(x + plate.back)) > 0.02:  # an edge of a circle is steep there
        assert 2.0 * half == pytest.approx(extent(plate, (x, -3.0), (x, 3.0)), abs=10 * CLOSE)


@settings(max_examples=40)
@given(PLATES, PLACES, PLACES)
def test_the_room_is_the_distance_to_the_edge_inside(
    plate: RoundPlate | RectangularPlate, x: float, y: float
) -> None:
    shape, at = polygon(plate), Point(x, y)
    room = plate.room(x, y)
    if shape.boundary.distance(at) < CLOSE:
        assert abs(room) < 2 * CLOSE
    elif shape.contains(at):
        assert room == pytest.approx(shape.boundary.distance(at), abs=CLOSE)
    else:
        assert room < 0.0


@pytest.mark.parametrize("plate", [RoundPlate(0.15), RectangularPlate(0.3, 0.2, 0.25)])
def test_beyond_the_plate_there_is_nothing(plate: RoundPlate | RectangularPlate) -> None:
    assert plate.half_width_at(plate.front + 1e-9) == pytest.approx(0.0, abs=1e-4)
    assert plate.half_width_at(-plate.back - 1e-3) == 0.0


def test_a_plate_names_its_size_in_millimetres() -> None:
    assert str(RoundPlate(0.15)) == "plate of 150 mm radius"
    assert str(RectangularPlate(0.264, 0.244, 0.215)) == "plate of 508 x 430 mm"
