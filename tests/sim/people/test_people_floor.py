"""Tests the floor on which people walk: where they fit, what they can reach, and what obstructs them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.sim.people.scenes import room, two_rooms, wall

from chefbot.maths.se2 import SE2
from chefbot.sim.people.floor import (
    MARGIN,
    MAX_DESTINATIONS,
    MAX_PATH_CELLS,
    REACH,
    STEP_HEIGHT,
    PeopleFloor,
    solid_boxes,
)
from chefbot.sim.world.furniture import PERSON_HEIGHT, PERSON_RADIUS
from chefbot.sim.world.shapes import SimulatedShape, box, cylinder, distance

GREY = (200, 200, 200)
TWO_ROOMS = (-0.1, -0.1, 8.1, 4.1)
SQUARE = (0.0, 0.0, 6.0, 6.0)
PLACES = st.tuples(st.floats(0.5, 5.5), st.floats(0.5, 5.5))
RADIUS = PERSON_RADIUS + MARGIN
CLOSED = np.array([[4.0, 2.0, 0.05, 0.5, 1.0, 0.0, 0.0]])
"""What closes the doorway between the two rooms."""


def floor_of(solids, bounds=SQUARE, start=(1.0, 1.0)) -> PeopleFloor:
    return PeopleFloor(solids, bounds, start)


@pytest.fixture(scope="module")
def square() -> PeopleFloor:
    """The floor of an empty room."""
    return floor_of(room(6.0, 6.0))


@given(st.floats(-1.0, 9.0), st.floats(-1.0, 5.0))
@settings(max_examples=60)
def test_people_fit_where_they_have_room(x: float, y: float) -> None:
    solids, floor = two_rooms(), TWO_ROOM_FLOOR
    gap = min(float(distance(solid, np.array(x), np.array(y))) for solid in solids)
    edge = min(x + 0.1, 8.1 - x, y + 0.1, 4.1 - y)
    if min(gap, edge) > RADIUS + 0.1:
        assert floor.fits(x, y)
    elif min(gap, edge) < RADIUS - 0.1:
        assert not floor.fits(x, y)
    if edge > 0.1 and gap > 0.1:
        assert floor.free(x, y) == pytest.approx(min(gap, edge, REACH), abs=0.03)


TWO_ROOM_FLOOR = floor_of(two_rooms(), TWO_ROOMS)


def test_points_are_the_middles_of_cells(square: PeopleFloor) -> None:
    for cell in square.cells[::37]:
        assert square.cell(*square.point(cell)) == tuple(cell)
        assert square.fits(*square.point(cell))
    rng = np.random.default_rng(1)
    assert all(square.fits(*square.draw_point(rng)) for _ in range(50))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_only_floor_that_leads_to_the_start_counts(axis: int, side: float) -> None:
    between = (3.0, 0.0, 3.0, 6.0) if axis == 0 else (0.0, 3.0, 6.0, 3.0)
    start = [3.0, 3.0]
    start[axis] += 2.0 * side
    floor = floor_of([*room(6.0, 6.0), wall("between", *between)], start=(start[0], start[1]))
    middles = np.array([floor.point(cell) for cell in floor.cells])
    assert len(middles) > 500 and (side * (middles[:, axis] - 3.0) > 0.0).all()


def test_a_start_in_a_wall_is_taken_to_the_floor_nearby() -> None:
    assert len(floor_of(room(6.0, 6.0), start=(0.0, 3.0)).cells) > 2000


def test_where_nobody_fits_there_is_no_floor() -> None:
    assert len(floor_of(room(0.4, 0.4), (0.0, 0.0, 0.4, 0.4), (0.2, 0.2)).cells) == 0


@given(PLACES, PLACES)
@settings(max_examples=40)
def test_paths_in_the_open_are_little_longer_than_straight(start, end) -> None:
    floor = floor_of(room(6.0, 6.0))
    length, straight = floor.path_length(floor.add_destination(*end), *start), math.dist(start, end)
    assert straight - 0.35 <= length
    if min(*start, *end) > 1.0 and max(*start, *end) < 5.0:
        assert length <= 1.09 * straight + 0.2


def test_a_path_leads_through_the_doorway() -> None:
    floor = floor_of(two_rooms(), TWO_ROOMS)
    number = floor.add_destination(7.0, 0.6)
    by_doorway = math.dist((1.0, 0.6), (4.0, 2.0)) + math.dist((4.0, 2.0), (7.0, 0.6))
    assert by_doorway - 0.3 <= floor.path_length(number, 1.0, 0.6) <= 1.5 * by_doorway
    assert floor.destination(number) == (7.0, 0.6)


def test_a_closed_door_leaves_no_path_until_it_opens() -> None:
    floor = floor_of(two_rooms(), TWO_ROOMS)
    number = floor.add_destination(7.0, 2.0)
    before = floor.path_length(number, 1.0, 2.0)
    floor.obstruct(CLOSED)
    assert floor.path_length(number, 1.0, 2.0) == math.inf
    assert floor.path_length(number, 6.0, 2.0) < 1.5
    assert floor.free(4.0, 2.0) > 0.3, "what moves is not among the solids"
    floor.obstruct(np.empty((0, 7)))
    assert floor.path_length(number, 1.0, 2.0) == before


def test_a_solid_that_is_put_down_stays() -> None:
    floor = floor_of(two_rooms(), TWO_ROOMS)
    number = floor.add_destination(7.0, 2.0)
    assert floor.path_length(number, 1.0, 2.0) < math.inf
    floor.add([wall("shut", 4.0, 1.5, 4.0, 2.5)])
    floor.obstruct(np.empty((0, 7)))
    assert floor.path_length(number, 1.0, 2.0) == math.inf
    assert not floor.in_sight(1.0, 2.0, 7.0, 2.0)


def test_no_path_leads_to_where_nobody_fits(square: PeopleFloor) -> None:
    inside_wall, outside = square.add_destination(0.0, 3.0), square.add_destination(20.0, 3.0)
    assert square.path_length(inside_wall, 3.0, 3.0) == square.path_length(outside, 3.0, 3.0) == math.inf


def test_destinations_are_numbered_and_bounded() -> None:
    floor = floor_of(room(6.0, 6.0))
    points = [(1.0 + 0.01 * k, 2.0) for k in range(MAX_DESTINATIONS)]
    assert [floor.add_destination(*point) for point in points] == list(range(MAX_DESTINATIONS))
    assert [floor.destination(k) for k in range(MAX_DESTINATIONS)] == points
    with pytest.raises(ValueError, match="at most 96 destinations"):
        floor.add_destination(1.0, 1.0)


def test_sight_and_rays_end_at_walls() -> None:
    floor = TWO_ROOM_FLOOR
    assert floor.in_sight(1.0, 2.0, 7.0, 2.0) and not floor.in_sight(1.0, 1.0, 7.0, 1.0)
    assert floor.is_clear(1.0, 2.0, 7.0, 2.0, 0.3) and not floor.is_clear(1.0, 2.0, 7.0, 2.0, 0.5)
    assert floor.ray(1.0, 1.0, 1.0, 0.0, 5.0) == pytest.approx(2.95, abs=0.06)
    assert floor.ray(1.0, 2.0, 1.0, 0.0, 5.0) == 5.0


@pytest.mark.parametrize(
    ("bottom", "top", "counts"),
    [
        (0.0, 1.0, True),
        (0.0, 0.9 * STEP_HEIGHT, False),
        (1.0, 1.2, True),
        (PERSON_HEIGHT + 0.1, 3.0, False),
    ],
)
def test_people_step_over_what_is_flat_and_pass_below_lamps(bottom: float, top: float, counts: bool) -> None:
    solid = box("thing", SE2(3.0, 3.0, 0.5), bottom, (0.4, 0.6, top - bottom), GREY)
    assert len(solid_boxes([solid])) == counts
    assert floor_of([*room(6.0, 6.0), solid]).fits(3.0, 3.0) != counts


@given(st.floats(-3.0, 3.0), st.booleans(), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
@settings(max_examples=15)
def test_round_and_turned_solids_are_as_large_as_they_are(
    yaw: float, is_round: bool, dx: float, dy: float
) -> None:
    solid: SimulatedShape = (
        cylinder("post", (3.0, 3.0), 0.0, 0.3, 1.0, GREY)
        if is_round
        else box("crate", SE2(3.0, 3.0, yaw), 0.0, (0.5, 0.9, 1.0), GREY)
    )
    x, y = 3.0 + dx, 3.0 + dy
    expected = float(distance(solid, np.array(x), np.array(y)))
    found = floor_of([solid], (2.0, 2.0, 4.0, 4.0)).free(x, y)
    assert found == pytest.approx(expected, abs=0.03)


def test_a_hall_has_larger_cells_and_a_field_only_the_start() -> None:
    small, hall, field = (floor_of([], (0.0, 0.0, side, side)) for side in (20.0, 80.0, 900.0))
    assert small.path_frame[2] == 0.1
    assert 0.1 < hall.path_frame[2] < 0.2 and hall.path_costs[0].size <= 1.01 * MAX_PATH_CELLS
    assert field.path_frame[2] == pytest.approx(0.2) and field.path_costs[0].size <= 1.01 * MAX_PATH_CELLS
    assert field.fits(5.0, 5.0) and not field.fits(800.0, 800.0)
    corner = floor_of([], (0.0, 0.0, 900.0, 900.0), (5.0, 700.0))
    assert corner.fits(5.0, 700.0) and not corner.fits(5.0, 5.0) and not corner.fits(700.0, 700.0)
    assert hall.fits(79.0, 79.0)


def test_nobody_leaves_the_bounds() -> None:
    floor = floor_of([], (0.0, 0.0, 3.0, 2.0))
    assert floor.fits(1.5, 1.0)
    assert not floor.fits(0.1, 1.0) and not floor.fits(1.5, 1.9) and not floor.fits(-1.0, 1.0)
