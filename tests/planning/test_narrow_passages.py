"""Which maps leave a narrow path only: the width that counts as wide, and a start within a passage."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.narrow_passages import is_map_narrow

START, GOAL = SE2(0.5, 1.0, 0.0), SE2(2.5, 1.0, 0.0)


def with_gap(cells: int) -> Costmap:
    """Return costs of 3 m by 2 m with a wall at x = 1.5 m in which so many cells are open."""
    costs = np.full((40, 60), FREE, np.uint8)
    costs[:, 28:33] = INSCRIBED
    costs[:, 30] = LETHAL
    costs[20 : 20 + cells, 28:33] = FREE
    return Costmap(costs, 0.05, 0.0, 0.0)


@pytest.mark.parametrize(("cells", "narrow"), [(0, True), (1, True), (2, True), (3, False), (10, False)])
def test_a_path_is_wide_if_a_cell_on_each_side_may_be_marked(cells: int, narrow: bool) -> None:
    costs = with_gap(cells)
    before = costs.cells.copy()
    assert is_map_narrow(GridPlanner(), costs, START, GOAL) == narrow
    assert np.array_equal(costs.cells, before)


def test_a_robot_beside_a_wall_is_in_a_narrow_place() -> None:
    assert is_map_narrow(GridPlanner(), with_gap(10), SE2(1.45, 0.3, 0.0), GOAL)


@pytest.mark.parametrize("x", [1.44, 1.5, 1.6])
def test_a_robot_in_a_gap_that_is_just_open_is_in_a_narrow_place(x: float) -> None:
    """From there a planner would begin behind the gap, where the way is wide."""
    assert is_map_narrow(GridPlanner(), with_gap(2), SE2(x, 1.04, 0.0), GOAL)


def test_without_walls_nothing_is_narrow() -> None:
    free = Costmap(np.full((40, 60), FREE, np.uint8), 0.05, 0.0, 0.0)
    assert not is_map_narrow(GridPlanner(), free, START, GOAL)
