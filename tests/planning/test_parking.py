"""Parking places: at a wall, out of doorways and corridors, away from tables, and the nearest of them."""

from __future__ import annotations

import numpy as np
import pytest
from tests.planning.rooms import RESOLUTION, corridor, two_rooms

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.planning.parking import PLACE_DISTANCE, WALL_GAP, WALL_SLACK, ParkingSearch

RADIUS = 0.18


def lengths_from(grid: Grid, x: float, y: float) -> np.ndarray:
    """Straight lengths to the free cells; enough to distinguish near from far."""
    rows, columns = np.indices(grid.cells.shape)
    straight = np.hypot(grid.origin_x + columns * RESOLUTION - x, grid.origin_y + rows * RESOLUTION - y)
    return np.where(grid.cells == 0, straight, np.inf).astype(np.float32)


@pytest.mark.parametrize("x", [1.0, 3.0, 3.9])
def test_a_robot_near_the_door_parks_beside_it_not_in_it(x: float) -> None:
    grid = two_rooms(door=1.0)
    search = ParkingSearch(grid, RADIUS)
    place = search.nearest(lengths_from(grid, x, 2.0))
    assert place is not None
    in_door = abs(place.pose.x - 4.0) < 0.6 and abs(place.pose.y - 2.0) < 0.5
    assert not in_door
    assert not search.leaves_room_to_pass(*grid.cell(4.0, 2.0)), "the middle of the doorway"
    assert not search.leaves_room_to_pass(*grid.cell(4.0, 1.5 + RADIUS + WALL_GAP)), "the edge of the doorway"


@pytest.mark.parametrize(("width", "parks"), [(0.8, False), (1.1, False), (1.8, True)])
def test_a_corridor_is_blocked_unless_people_pass(width: float, parks: bool) -> None:
    grid = corridor(width)
    place = ParkingSearch(grid, RADIUS).nearest(lengths_from(grid, 5.0, width / 2))
    in_the_middle = place is not None and 1.0 < place.pose.x < 9.0
    assert in_the_middle == parks


def test_the_robot_stands_at_the_wall_and_looks_away_from_it() -> None:
    grid = two_rooms(door=1.0)
    place = ParkingSearch(grid, RADIUS).nearest(lengths_from(grid, 2.0, 0.6))
    assert place is not None
    assert RADIUS + WALL_GAP <= place.pose.y <= RADIUS + WALL_GAP + WALL_SLACK + RESOLUTION
    assert place.pose.yaw == pytest.approx(np.pi / 2, abs=0.3)


def test_places_where_people_are_served_stay_free() -> None:
    grid = two_rooms(door=1.0)
    table = SE2(2.0, 0.4, 0.0)
    place = ParkingSearch(grid, RADIUS, (table, SE2(99.0, 0.0, 0.0))).nearest(lengths_from(grid, 2.0, 0.4))
    assert place is not None and place.pose.distance(table) >= RADIUS + PLACE_DISTANCE - RESOLUTION


def test_legs_of_chairs_are_not_walls() -> None:
    grid = two_rooms(door=1.0)
    cells = grid.cells.copy()
    cells[40, 40] = 100
    with_leg = Grid(cells, RESOLUTION, grid.origin_x, grid.origin_y)
    place = ParkingSearch(with_leg, RADIUS).nearest(lengths_from(grid, 2.0, 2.2))
    assert place is not None and min(place.pose.x, place.pose.y, 4.0 - place.pose.y) < 0.7


@pytest.mark.parametrize(
    "cells", [np.zeros((5, 5)), np.full((40, 40), -1), np.full((40, 40), 100), np.zeros((1, 1))]
)
def test_maps_without_a_place_to_park(cells: np.ndarray) -> None:
    grid = Grid(cells.astype(np.int8), RESOLUTION, 0.0, 0.0)
    assert ParkingSearch(grid, RADIUS).nearest(np.zeros(cells.shape, np.float32)) is None
    assert ParkingSearch(grid, RADIUS).nearest(np.full(cells.shape, np.inf, np.float32)) is None
