"""Tests that paths planned with a localization error are replanned locally and lead through narrow doors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.control.controller import ControllerStatus
from chefbot.control.dwa import DwaController
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner, path_length
from chefbot.planning.local_replanning import (
    CHECK_DISTANCE,
    GOAL_TOLERANCE,
    MAX_DETOUR,
    local_planner,
    replan_locally,
)
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.safety.velocity_limiter import VelocityLimiter

ROBOT = load_robot("chefbot")
CELL, PERIOD = 0.05, 0.1


def costs_of(*walls: tuple[int, int, int, int]) -> Costmap:
    """Return a costmap of 6 x 6 m; walls are (row from, to, column from, to) in cells."""
    cells = np.zeros((120, 120), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    for top, bottom, left, right in walls:
        cells[top:bottom, left:right] = 100
    layers = LayeredCostmap(CostmapParams(), ROBOT.footprint)
    layers.set_static(Grid(cells, CELL, 0.0, 0.0))
    return layers.update()


NARROW = costs_of((52, 56, 0, 70), (66, 70, 30, 120))
"""A passage of half a metre in the middle with an opening at each end."""


def displaced_path(costmap: Costmap, start: SE2, goal: SE2, off: tuple[float, float]) -> np.ndarray:
    """Return the path that is planned with a localization error `off` in metres."""
    path = GridPlanner().plan(costmap, SE2(start.x + off[0], start.y + off[1], start.yaw), goal)
    return path - np.array([*off, 0.0])


def drive(
    costmap: Costmap, goal: SE2, start: SE2, off: tuple[float, float], *, replan: bool
) -> ControllerStatus:
    """Return the controller's status after 60 s with a new plan each second and control at 10 Hz."""
    limits = Limits.of(ROBOT)
    dwa, limiter, planner, pose, now = (
        DwaController(limits),
        VelocityLimiter(limits),
        local_planner(),
        start,
        (0.0, 0.0),
    )
    status = ControllerStatus.NO_PATH
    for step in range(600):
        if step % 10 == 0:
            path = given = displaced_path(costmap, pose, goal, off)
            dwa.set_path(path, same_goal=step > 0)
        new = replan_locally(path, pose, costmap, planner) if replan else path
        if new is not given:
            given = new
            dwa.set_path(given, same_goal=True)
        v, w, status = dwa.command(pose, now, costmap)
        if status is ControllerStatus.REACHED:
            break
        now = limiter.step(v, w, 0.0, PERIOD)
        turn = SE2(0.0, 0.0, now[1] * PERIOD / 2)
        pose = pose @ turn @ SE2(now[0] * PERIOD, 0.0, 0.0) @ turn
        assert costmap.at(pose.x, pose.y) <= INSCRIBED
    return status


@pytest.mark.parametrize("off", [(0.0, 0.08), (0.05, -0.08), (-0.08, 0.06)])
def test_local_replanning_passes_a_door_offset_from_the_map(off):
    start, goal = SE2(1.0, 2.0, 0.0), SE2(5.0, 4.5, 0.0)
    assert drive(NARROW, goal, start, off, replan=True) is ControllerStatus.REACHED


def test_without_local_replanning_the_door_is_blocked():
    start, goal = SE2(1.0, 2.0, 0.0), SE2(5.0, 4.5, 0.0)
    assert drive(NARROW, goal, start, (0.0, 0.08), replan=False) is ControllerStatus.BLOCKED


def test_a_free_path_is_unchanged():
    costmap = costs_of((58, 62, 0, 40))
    path = GridPlanner().plan(costmap, SE2(1.0, 1.0, 0.0), SE2(5.0, 5.0, 0.0))
    assert replan_locally(path, SE2(1.0, 1.0, 0.0), costmap, local_planner()) is path


def test_a_long_detour_is_left_to_the_global_planner():
    path = np.column_stack([np.arange(1.0, 5.0, 0.05), np.full(80, 3.0), np.zeros(80)])
    costmap = costs_of((20, 119, 40, 44))
    assert replan_locally(path, SE2(1.0, 3.0, 0.0), costmap, local_planner()) is path


def test_a_goal_just_inside_an_obstacle_is_moved_beside_it():
    path = np.column_stack([np.arange(1.0, 1.65, 0.05), np.full(13, 3.0), np.zeros(13)])
    costmap = costs_of((50, 70, 36, 50))
    replanned = replan_locally(path, SE2(1.0, 3.0, 0.0), costmap, local_planner())
    assert costmap.at(path[-1, 0], path[-1, 1]) == INSCRIBED > costmap.at(replanned[-1, 0], replanned[-1, 1])
    assert np.hypot(*(replanned[-1, :2] - path[-1, :2])) <= GOAL_TOLERANCE


def test_a_goal_far_inside_an_obstacle_stays_blocked():
    path = np.column_stack([np.arange(1.0, 2.0, 0.05), np.full(20, 3.0), np.zeros(20)])
    costmap = costs_of((50, 70, 36, 50))
    assert replan_locally(path, SE2(1.0, 3.0, 0.0), costmap, local_planner()) is path


@settings(max_examples=60)
@given(
    st.tuples(st.floats(0.5, 2.5), st.floats(0.5, 2.2)),
    st.tuples(st.floats(3.5, 5.5), st.floats(3.8, 5.5)),
    st.tuples(st.floats(-0.1, 0.1), st.sampled_from([-0.1, -0.07, 0.07, 0.1])),
    st.floats(0.2, 1.2),
)
def test_a_repaired_path_is_free_from_robot_to_goal(a, b, off, before):
    path = displaced_path(NARROW, SE2(*a, 0.0), SE2(*b, 0.0), off)
    blocked = next(i for i, (x, y, _) in enumerate(path) if NARROW.at(x, y) >= INSCRIBED)
    here = SE2.of(path[max(0, blocked - round(before / 0.045))])
    replanned = replan_locally(path, here, NARROW, local_planner())
    assert replanned is not path
    assert path_length(replanned) <= path_length(path) + MAX_DETOUR + 0.2
    assert np.hypot(*(replanned[0, :2] - np.array([here.x, here.y]))) < 1e-6
    assert (replanned[-1] == path[-1]).all()
    travelled = np.cumsum(np.hypot(*np.diff(replanned[:, :2], axis=0).T))
    assert all(NARROW.at(x, y) < INSCRIBED for x, y, _ in replanned[1:][travelled <= CHECK_DISTANCE - before])
