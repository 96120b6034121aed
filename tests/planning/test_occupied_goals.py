"""Goals that are occupied: the nearest free pose with sight of the goal."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.goal_sight import has_sight
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import PlanningError, PlanningFailure

SIDE, CELL = 80, 0.05
WALL = 2.0
"""x of a wall across the map that is 10 cm thick, with a door at the top, m."""


def walls() -> Costmap:
    cells = np.zeros((SIDE, SIDE), np.uint8)
    cells[: SIDE - 20, 40:42] = LETHAL
    return Costmap(cells, CELL, 0.0, 0.0)


def taken(costs: Costmap, x: float, y: float, radius: float) -> Costmap:
    """Return the costs with a disc around a point in which the robot's centre must not be."""
    rows, columns = np.indices(costs.cells.shape)
    near = np.hypot((columns + 0.5) * CELL - x, (rows + 0.5) * CELL - y) <= radius
    cells = np.where(near, np.maximum(costs.cells, INSCRIBED), costs.cells).astype(np.uint8)
    return Costmap(cells, CELL, 0.0, 0.0)


def planner(tolerance: float = 0.5) -> GridPlanner:
    planner = GridPlanner(PlannerParams(tolerance=tolerance))
    planner.walls = walls
    return planner


START = SE2(0.5, 0.5, 0.0)


def test_an_occupied_goal_is_replaced_by_the_nearest_free_pose() -> None:
    costs = taken(walls(), 1.0, 1.5, 0.3)
    goal = SE2(1.0, 1.5, 0.8)
    end = SE2.of(planner().plan(costs, START, goal)[-1])
    assert 0.3 < end.distance(goal) < 0.5 and end.yaw == pytest.approx(goal.yaw)


@given(st.floats(1.75, 1.95), st.floats(0.6, 2.2), st.floats(0.2, 0.4))
def test_the_free_pose_is_never_beyond_a_wall(x: float, y: float, radius: float) -> None:
    costs, goal = taken(walls(), x, y, radius), SE2(x, y, 0.0)
    try:
        end = SE2.of(planner().plan(costs, START, goal)[-1])
    except PlanningError as error:
        assert error.failure is PlanningFailure.GOAL_OCCUPIED
    else:
        assert end.x < WALL and bool(has_sight(walls(), np.array([[end.x, end.y]]), goal)[0])


def test_without_sight_the_goal_is_occupied() -> None:
    """All of the goal's side is taken, and what is free is beyond the wall."""
    costs = walls()
    costs.cells[:60, 30:40] = INSCRIBED
    goal = SE2(1.9, 1.0, 0.0)
    with pytest.raises(PlanningError, match="occupied"):
        planner(0.4).plan(costs, START, goal)
    blind = planner(0.4)
    blind.walls = None
    assert SE2.of(blind.plan(costs, START, goal)[-1]).x > WALL


def test_the_pose_stays_on_one_side_of_the_obstacle() -> None:
    goal, one = SE2(1.0, 1.5, 0.0), planner()
    before = SE2.of(one.plan(taken(walls(), 1.0, 1.5, 0.3), START, goal)[-1])
    assert before.distance(START) < goal.distance(START)  # on the robot's side
    behind = SE2(1.2, 2.6, 0.0)
    grown = taken(walls(), 1.0, 1.5, 0.34)
    grown.cells[grown.cell(before.x, before.y)] = INSCRIBED
    after = SE2.of(one.plan(grown, behind, goal)[-1])
    assert after.distance(before) < 0.2
    assert SE2.of(planner().plan(grown, behind, goal)[-1]).distance(before) > 0.4
    assert SE2.of(one.plan(walls(), START, goal)[-1]).distance(goal) < 1e-9  # free again


def test_sight_ends_in_a_wall_but_does_not_lead_through() -> None:
    in_wall, beside = SE2(2.05, 1.0, 0.0), SE2(1.8, 1.0, 0.0)
    points = np.array([[1.5, 1.0], [2.5, 1.0]])
    assert has_sight(walls(), points, in_wall).tolist() == [True, True]
    assert has_sight(walls(), points, beside).tolist() == [True, False]
    assert has_sight(walls(), np.zeros((0, 2)), beside).shape == (0,)


def test_unknown_space_and_the_outside_hide_a_goal() -> None:
    costs = walls()
    costs.cells[10, 10:12] = UNKNOWN
    goal = SE2(0.3, 0.525, 0.0)
    assert has_sight(costs, np.array([[0.7, 0.525], [0.3, 0.9]]), goal).tolist() == [False, True]
    assert not has_sight(costs, np.array([[-0.2, 0.525]]), SE2(0.1, 0.525, 0.0))[0]
