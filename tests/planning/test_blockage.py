"""What blocks a path: people, an obstacle that may go away, or the map itself; and where to wait."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.planning.rooms import two_rooms

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.sources import LASER
from chefbot.maths.costs import LETHAL
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.planning.blockage import Blockage, PathCosts, find_blockage
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.parking import PERSON_WIDTH, ParkingSearch
from chefbot.planning.waiting_place import STANDOFF, find_waiting_place

RADIUS = 0.18
DOOR, HERE, THERE = (4.0, 2.0), SE2(1.0, 2.0, 0.0), SE2(6.5, 2.0, 0.0)
NOBODY = np.empty((0, 2))


class Floor:
    """Two rooms with a door between them, and what a lidar has marked."""

    def __init__(self, grid: Grid) -> None:
        self.grid, self.layers = grid, LayeredCostmap(CostmapParams(), disc(RADIUS))
        self.layers.set_static(grid)
        self.planner = GridPlanner()

    def mark(self, x: float, y: float, radius: float = 0.22) -> None:
        cells, resolution = self.layers.source_cells(LASER), self.grid.resolution
        rows, columns = np.indices(cells.shape)
        px = self.grid.origin_x + (columns + 0.5) * resolution
        py = self.grid.origin_y + (rows + 0.5) * resolution
        cells[np.hypot(px - x, py - y) <= radius] = LETHAL
        self.layers.note_change(SE2(x, y, 0.0), radius)

    def blockage(self, robot: SE2 = HERE, people: object = NOBODY) -> Blockage | None:
        costs = PathCosts(self.layers.update(), self.layers.static_costs())
        return find_blockage(self.planner, costs, robot, THERE, np.asarray(people, float), RADIUS)


@pytest.fixture
def floor() -> Floor:
    return Floor(two_rooms(door=1.0))


def test_a_free_path_is_not_blocked_by_people_beside_it(floor: Floor) -> None:
    assert floor.blockage() is None
    floor.mark(1.0, 3.5)
    assert floor.blockage(people=[(1.0, 3.5)]) is None


def test_people_in_the_only_door_block_the_path(floor: Floor) -> None:
    places = [(3.6, 2.0), (4.4, 2.0), (1.0, 3.6)]
    for place in places:
        floor.mark(*place)
    found = floor.blockage(people=places)
    assert found is not None and found.people == (0, 1) and math.isinf(found.length)
    assert found.free_length == pytest.approx(5.5, abs=0.3)
    assert 3.6 - 0.8 < 1.0 + found.distance < 3.6


def test_a_closed_door_blocks_the_path_but_is_nobody(floor: Floor) -> None:
    for y in np.arange(1.5, 2.55, 0.1):
        floor.mark(4.0, float(y), 0.1)
    found = floor.blockage(people=[(1.0, 3.5)])
    assert found is not None and found.people == () and math.isinf(found.length)


def test_a_wall_of_the_map_is_not_a_blockage() -> None:
    grid = two_rooms(door=1.0)
    cells = grid.cells.copy()
    cells[:, int((4.0 - grid.origin_x) / grid.resolution)] = 100
    closed = Floor(Grid(cells, grid.resolution, grid.origin_x, grid.origin_y))
    assert closed.blockage() is None


def test_the_other_path_is_compared_with_the_blocked_one(floor: Floor) -> None:
    cells = floor.grid.cells.copy()
    rows = slice(*(int((y - floor.grid.origin_y) / floor.grid.resolution) for y in (0.2, 1.0)))
    columns = slice(*(int((x - floor.grid.origin_x) / floor.grid.resolution) for x in (3.6, 4.4)))
    cells[rows, columns] = 0
    two_doors = Floor(Grid(cells, floor.grid.resolution, floor.grid.origin_x, floor.grid.origin_y))
    two_doors.mark(*DOOR)
    found = two_doors.blockage(people=[DOOR])
    assert found is not None and found.people == (0,)
    assert 0.3 < found.length - found.free_length < 2.0


@pytest.mark.parametrize("x", [1.0, 2.6, 3.3, 3.9, 4.3])
def test_it_waits_before_the_doorway_and_not_in_it(floor: Floor, x: float) -> None:
    person = (4.9, 2.0)
    for place in (person, (4.4, 2.0)):
        floor.mark(*place)
    robot = SE2(min(x, 3.7), 2.0, 0.0)
    found = floor.blockage(robot, [person, (4.4, 2.0)])
    assert found is not None
    search = ParkingSearch(floor.grid, RADIUS)
    costs = PathCosts(floor.layers.update(), floor.layers.static_costs())
    place = find_waiting_place(search, floor.planner.params, costs, robot, found)
    assert place.leaves_room_to_pass and place.pose.x < 4.0 - 0.2
    cell = floor.grid.cell(place.pose.x, place.pose.y)
    assert search.leaves_room_to_pass(*cell, (PERSON_WIDTH,))
    blocked = found.free[found.blocked]
    line = np.linspace((place.pose.x, place.pose.y), blocked[:2], 100)
    assert (floor.grid.values(line[:, 0], line[:, 1], outside=0) == 0).all(), (
        "no wall hides the blocked place"
    )
    if robot.x < 2.0:
        gap = math.dist((place.pose.x, place.pose.y), blocked[:2])
        assert STANDOFF - 0.1 <= gap <= STANDOFF + 1.5, "near enough to go on soon"
