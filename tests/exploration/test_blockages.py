"""Obstacles that only the planner's costmap has, where exploration failed: behind them nothing is reachable."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chefbot.costmap.conversions import costmap_message
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.exploration.blockages import REACH, Blockages
from chefbot.maths.costs import INSCRIBED
from chefbot.maths.grid import FREE, OCCUPIED, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.std_msgs import Header
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams
from chefbot.robot.load import load_robot

RESOLUTION, SIZE = 0.05, 120
ROBOT = SE2(2.0, 3.0, 0.0)
RADIUS = load_robot("chefbot_lidar").inscribed_radius
NO_PATH = np.zeros((0, 3))


def room() -> Grid:
    """A room of 6 x 6 m with a wall at x = 3 m, in which a mirror shows a free passage at y = 3 m."""
    cells = np.full((SIZE, SIZE), FREE, np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = cells[:, 60] = OCCUPIED
    cells[50:70, 60] = FREE
    return Grid(cells, RESOLUTION, 0.0, 0.0)


def with_mirror(grid: Grid, column: int = 60) -> Grid:
    """The planner's costmap: the ranger has marked the mirror."""
    cells = grid.cells.copy()
    cells[50:70, column] = OCCUPIED
    return Grid(cells, RESOLUTION, 0.0, 0.0)


def reachable(grid: Grid, x: float, y: float) -> bool:
    costs = LayeredCostmap(CostmapParams(), load_robot("chefbot_lidar").footprint)
    costs.set_static(grid)
    potential = GridPlanner(PlannerParams()).potential(costs.update(), ROBOT)
    return bool(np.isfinite(potential[grid.cell(x, y)]))


def test_what_lies_behind_a_mirror_is_not_reachable() -> None:
    grid, blockages = room(), Blockages(RADIUS)
    assert reachable(blockages.on(grid), 4.0, 3.0)
    assert blockages.add(ROBOT, NO_PATH, with_mirror(grid), grid)
    assert not blockages.add(ROBOT, NO_PATH, with_mirror(grid), grid), "it is known by now"
    assert not reachable(blockages.on(grid), 4.0, 3.0)
    assert reachable(blockages.on(grid), 2.0, 5.0), "this side is free as before"
    assert np.array_equal(grid.cells, room().cells), "the map itself is as it was"


def test_what_is_on_the_path_counts_from_far_away() -> None:
    """Having failed, the robot may have backed up, or have turned back long before the mirror."""
    grid, blockages, far = room(), Blockages(RADIUS), SE2(0.5, 5.0, 0.0)
    assert not blockages.add(far, NO_PATH, with_mirror(grid), grid)
    path = np.column_stack([np.linspace(0.5, 4.0, 50), np.linspace(5.0, 3.0, 50), np.zeros(50)])
    assert blockages.add(far, path, with_mirror(grid), grid)
    marked = np.argwhere(blockages.on(grid).cells != grid.cells)
    assert len(marked) and np.all(marked[:, 1] == 60) and np.all(marked[:, 0] >= 60), "near the path"


def test_a_gap_that_only_the_planner_finds_too_narrow_is_blocked() -> None:
    """The ranger has marked the middle of the mirror; between that and the wall the body just fits."""
    grid, blockages = room(), Blockages(RADIUS)
    marked = with_mirror(grid)
    marked.cells[50:70, 60] = FREE
    marked.cells[57:63, 60] = OCCUPIED
    distance = np.hypot(*np.meshgrid(np.arange(-4, 5), np.arange(-4, 5)))
    for row, column in np.argwhere(marked.cells == OCCUPIED):
        window = marked.cells[max(row - 4, 0) : row + 5, max(column - 4, 0) : column + 5]
        if window.shape == distance.shape:
            window[(distance <= 4) & (window < 99)] = 99
    path = np.column_stack([np.linspace(2.0, 4.0, 60), np.full(60, 2.65), np.zeros(60)])
    assert blockages.add(ROBOT, path, marked, grid)
    changed = np.argwhere(blockages.on(grid).cells != grid.cells) + 0.5
    assert len(changed) > 20
    assert np.hypot(*(RESOLUTION * changed[:, ::-1] - [ROBOT.x, ROBOT.y]).T).min() > 0.4
    blockages.forget_gone(ROBOT, grid, grid)
    assert blockages.on(grid) is grid


def test_it_is_free_again_once_the_obstacle_is_seen_gone() -> None:
    grid, blockages = room(), Blockages(RADIUS)
    blockages.add(ROBOT, NO_PATH, with_mirror(grid), grid)
    blockages.forget_gone(ROBOT, with_mirror(grid), grid)
    assert not reachable(blockages.on(grid), 4.0, 3.0)
    blockages.forget_gone(SE2(0.5, 0.5, 0.0), grid, grid)
    assert not reachable(blockages.on(grid), 4.0, 3.0), "it was too far away to see that"
    blockages.forget_gone(ROBOT, grid, grid)
    assert blockages.on(grid) is grid


def as_published(cells: np.ndarray) -> Grid:
    """The planner's costmap as it is published: 100 lethal, 99 within the inscribed radius of an obstacle."""
    costs = LayeredCostmap(CostmapParams(), load_robot("chefbot_lidar").footprint)
    costs.set_static(Grid(cells, RESOLUTION, 0.0, 0.0))
    return costmap_message(Header.of(0, "map"), costs.update()).grid


def test_a_doorway_that_somebody_has_left_is_open() -> None:
    """Where the person stood beside a jamb there is no room for the robot, as beside any wall."""
    cells = room().cells.copy()
    cells[50:70, 60] = OCCUPIED
    cells[54:66, 60] = FREE
    grid, blockages, with_person = Grid(cells, RESOLUTION, 0.0, 0.0), Blockages(RADIUS), cells.copy()
    with_person[55:65, 57:63] = OCCUPIED
    assert reachable(grid, 4.0, 3.0)
    assert blockages.add(ROBOT, NO_PATH, as_published(with_person), grid)
    assert not reachable(blockages.on(grid), 4.0, 3.0)
    blockages.forget_gone(ROBOT, as_published(cells), grid)
    assert blockages.on(grid) is grid


def test_where_the_robot_stands_is_no_blockage() -> None:
    grid, blockages = room(), Blockages(RADIUS)
    blockages.add(ROBOT, NO_PATH, with_mirror(grid), grid)
    blockages.forget_gone(SE2(3.0, 3.0, 0.0), with_mirror(grid), grid)
    costs = LayeredCostmap(CostmapParams(), load_robot("chefbot_lidar").footprint)
    costs.set_static(blockages.on(grid))
    assert costs.update().cells[grid.cell(3.0, 3.0)] < INSCRIBED


def test_obstacles_of_the_map_are_not_blockages() -> None:
    grid, blockages = room(), Blockages(RADIUS)
    blockages.add(ROBOT, NO_PATH, with_mirror(room(), column=60), with_mirror(grid, column=61))
    assert blockages.on(grid) is grid, "a cell beside a wall of the map is that wall, seen again"


@given(st.floats(0.1, 5.9), st.floats(0.1, 5.9), st.integers(0, 2**32 - 1))
def test_only_what_is_near_counts(x: float, y: float, seed: int) -> None:
    grid, blockages = Grid(np.full((SIZE, SIZE), FREE, np.int8), RESOLUTION, 0.0, 0.0), Blockages(RADIUS)
    marks = (np.random.default_rng(seed).random((SIZE, SIZE)) < 0.01).astype(np.int8) * OCCUPIED
    blockages.add(SE2(x, y, 0.0), NO_PATH, Grid(marks, RESOLUTION, 0.0, 0.0), grid)
    rows, columns = np.indices(marks.shape)
    distance = np.hypot(RESOLUTION * (columns + 0.5) - x, RESOLUTION * (rows + 0.5) - y)
    expected = np.where(distance <= REACH, marks, FREE)
    assert np.array_equal(blockages.on(grid).cells, expected)


def test_a_map_that_has_shrunk_ignores_what_lies_outside() -> None:
    grid, blockages = room(), Blockages(RADIUS)
    blockages.add(ROBOT, NO_PATH, with_mirror(grid), grid)
    small = Grid(grid.cells[:40, :40], RESOLUTION, 0.0, 0.0)
    assert np.array_equal(blockages.on(small).cells, small.cells)
