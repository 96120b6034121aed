"""Closed loop: planner, DWA, limiter, unicycle; collisions are judged against the exact squares."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chefbot.control.controller import ControllerStatus
from chefbot.control.dwa import DwaController
from chefbot.control.goal_checkers import GoalChecker, ProgressChecker
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner, path_length
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.safety.velocity_limiter import VelocityLimiter

ROBOT = load_robot("chefbot")
LIMITS = Limits.of(ROBOT)
CELL, PERIOD = 0.05, 0.1


def world(*walls):
    """6 x 6 m; walls are (row from, to, column from, to) in cells."""
    cells = np.zeros((120, 120), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    for top, bottom, left, right in walls:
        cells[top:bottom, left:right] = 100
    return cells


def costs_of(cells):
    costs = LayeredCostmap(CostmapParams(), ROBOT.footprint)
    costs.set_static(Grid(cells, CELL, 0.0, 0.0))
    return costs.update()


def clearance(cells, pose):
    """Metres between the robot's outline and the nearest occupied square."""
    corners = np.argwhere(cells >= 65)[:, ::-1] * CELL
    gap = np.maximum(np.maximum(corners - pose[:2], pose[:2] - corners - CELL), 0.0)
    return float(np.hypot(*gap.T).min()) - ROBOT.circumscribed_radius


def drive(cells, start, goal, seconds=90.0):
    """(status, end, distance driven, least clearance, speeds)."""
    costmap = costs_of(cells)
    path = GridPlanner().plan(costmap, start, goal)
    dwa, limiter, pose, now = DwaController(LIMITS), VelocityLimiter(LIMITS), start, (0.0, 0.0)
    dwa.set_path(path)
    driven, min_clearance, speeds = 0.0, np.inf, []
    for _ in range(round(seconds / PERIOD)):
        v, w, status = dwa.command(pose, now, costmap)
        if status is ControllerStatus.REACHED and now == (0.0, 0.0):
            break
        now = limiter.step(v, w, 0.0, PERIOD)
        for _ in range(5):
            turn = SE2(0.0, 0.0, now[1] * PERIOD / 10)
            pose = pose @ turn @ SE2(now[0] * PERIOD / 5, 0.0, 0.0) @ turn
            min_clearance = min(min_clearance, clearance(cells, pose))
        driven += now[0] * PERIOD
        speeds.append(now[0])
    return status, pose, driven, min_clearance, np.array(speeds), path_length(path)


@pytest.mark.parametrize(
    ("walls", "start", "goal"),
    [
        ([], (1.0, 1.0, 0.0), (5.0, 5.0, 0.0)),
        ([(58, 62, 0, 40), (58, 62, 58, 120)], (1.0, 1.0, 0.0), (5.0, 5.0, 1.0)),
        ([(30, 90, 0, 50), (30, 90, 66, 120)], (1.0, 1.0, 0.0), (5.0, 5.0, 1.0)),
        ([(50, 70, 50, 70)], (1.0, 3.0, 0.0), (5.0, 3.0, 0.0)),
        ([(30, 90, 0, 50), (30, 90, 66, 120), (86, 90, 0, 120)], (2.9, 4.0, 1.57), (1.0, 1.0, 3.0)),
    ],
    ids=["open floor", "door of 0.9 m", "passage of 0.8 m", "around a box", "U-turn in a dead end"],
)
def test_dwa_reaches_the_goal_without_contact_or_stops(walls, start, goal):
    status, pose, driven, min_clearance, speeds, planned = drive(world(*walls), SE2(*start), SE2(*goal))
    assert status is ControllerStatus.REACHED
    assert pose.distance(SE2(*goal)) < 0.15
    assert abs(pose.yaw - goal[2]) < 0.15
    assert min_clearance > 0.03
    assert driven < 1.1 * planned + 0.2
    moving = speeds > 0.01
    assert (moving[:-1] & ~moving[1:]).sum() <= 2


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(0.5, 5.5),
    st.floats(0.5, 5.5),
    st.floats(-3.1, 3.1),
)
def test_robot_can_always_stop_after_the_chosen_command(seed, speed, turn, x, y, yaw):
    """One command, then full braking: nothing is touched by that unless it was too late before."""
    rng = np.random.default_rng(seed)
    cells = world()
    for r, c in rng.integers(5, 110, (25, 2)):
        cells[r : r + 3, c : c + 3] = 100
    costmap = costs_of(cells)
    v, w = speed * LIMITS.speed, turn * LIMITS.angular_speed
    now = (v * LIMITS.scale(v, w), w * LIMITS.scale(v, w))
    dwa, pose = DwaController(LIMITS), SE2(x, y, yaw)
    dwa.set_path(np.column_stack([np.linspace(x, 5.0, 60), np.linspace(y, 5.0, 60), np.zeros(60)]))
    assume(clearance(cells, pose) >= 0.08 and _braked(cells, pose, now, now) >= 0.06)
    command = dwa.command(pose, now, costmap)
    assert _braked(cells, pose, now, command[:2]) > 0.0


def _braked(cells, pose, now, command):
    """Least clearance over one period with the command and then braking to a stand."""
    limiter, min_clearance = VelocityLimiter(LIMITS), np.inf
    limiter._v, limiter._w = now
    v, w = limiter.step(*command, 0.0, PERIOD)
    while True:
        for _ in range(5):
            turn = SE2(0.0, 0.0, w * PERIOD / 10)
            pose = pose @ turn @ SE2(v * PERIOD / 5, 0.0, 0.0) @ turn
            min_clearance = min(min_clearance, clearance(cells, pose))
        if (v, w) == (0.0, 0.0):
            return min_clearance
        v, w = limiter.step(0.0, 0.0, 0.0, PERIOD)


def test_a_wall_across_the_path_blocks_dwa():
    cells = world()
    dwa = DwaController(LIMITS)
    dwa.set_path(np.column_stack([np.linspace(1, 5, 80), np.full(80, 3.0), np.zeros(80)]))
    cells[:, 24:30] = 100
    v, _, status = dwa.command(SE2(0.96, 3.0, 0.0), (0.0, 0.0), costs_of(cells))
    assert status is ControllerStatus.BLOCKED
    assert v == 0.0


def test_dwa_stands_still_without_a_path():
    assert DwaController(LIMITS).command(SE2(1, 1, 0), (0.0, 0.0), costs_of(world())) == (
        0.0,
        0.0,
        ControllerStatus.NO_PATH,
    )


def test_the_goal_checker_latches():
    checker, goal = GoalChecker(), SE2(1.0, 1.0, 0.0)
    assert not checker.position_reached(SE2(0.8, 1.0, 0.0), goal)
    assert checker.position_reached(SE2(0.95, 1.0, 0.0), goal)
    assert checker.position_reached(SE2(0.8, 1.0, 0.0), goal)


def test_progress_checker_detects_standing_and_accepts_turning():
    checker = ProgressChecker(patience=1.0)
    assert all(checker.is_progressing(SE2(0.0, 0.0, 0.6 * i), 0.5) for i in range(10))
    assert [checker.is_progressing(SE2(0.0, 0.0, 5.4), 0.5) for _ in range(3)][-1] is False
