"""The final approach: tolerances kept from any start near the goal, with delays, noise and obstacles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.control.controller import ControllerCommand, ControllerStatus
from chefbot.control.final_approach import BEGIN_DISTANCE, MAX_REVERSE_DISTANCE, FinalApproach
from chefbot.control.goal_checkers import GoalParams
from chefbot.control.path_follower import PathFollower
from chefbot.maths.angles import wrap
from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

PERIOD, LATENCY_STEPS = 0.1, 1
TOLERANCE = GoalParams(xy_tolerance=0.02, yaw_tolerance=math.radians(2.0))
LIMITS = Limits.of(load_robot("chefbot"))
GOAL = SE2(1.0, -0.5, 0.7)
FREE = Costmap(np.zeros((80, 80), np.uint8), 0.05, -1.0, -2.5)


class Base:
    """A differential drive that ramps to a command after a delay of one period."""

    def __init__(self, pose: SE2) -> None:
        self.pose, self.twist = pose, (0.0, 0.0)
        self._pending = [(0.0, 0.0)] * LATENCY_STEPS
        self.turned = self.driven = 0.0

    def drive(self, v: float, w: float) -> None:
        self._pending.append((v, w))
        target = self._pending.pop(0)
        limits = (LIMITS.acceleration * PERIOD, LIMITS.angular_acceleration * PERIOD)
        self.twist = tuple(
            now + float(np.clip(then - now, -limit, limit))
            for now, then, limit in zip(self.twist, target, limits, strict=True)
        )
        self.pose = self.pose @ SE2(self.twist[0] * PERIOD, 0.0, self.twist[1] * PERIOD)
        self.driven += abs(self.twist[0]) * PERIOD
        self.turned += abs(self.twist[1]) * PERIOD


def approach(
    base: Base, costs: Costmap = FREE, noise: float = 0.0, seed: int = 0
) -> tuple[float, ControllerStatus]:
    """Run the approach; return how long it took, s, and its last status. noise: of the estimate, m and rad."""
    rng = np.random.default_rng(seed)
    final = FinalApproach(LIMITS, PERIOD)
    final.reset(TOLERANCE)
    status = ControllerStatus.RUNNING
    for k in range(300):
        estimate = base.pose @ SE2(*rng.normal(0.0, noise, 3)) if noise else base.pose
        if not final.is_active(estimate, GOAL, costs):
            return k * PERIOD, ControllerStatus.BLOCKED
        v, w, status = final.command(estimate, base.twist, GOAL, costs)
        assert abs(v) <= LIMITS.speed and abs(w) <= LIMITS.angular_speed + 1e-9
        if status is ControllerStatus.REACHED:
            return k * PERIOD, status
        base.drive(v, w)
    return 30.0, status


starts = st.tuples(
    st.floats(0.0, BEGIN_DISTANCE - 0.01), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi)
)


@settings(max_examples=150)
@given(starts)
def test_every_start_near_the_goal_ends_within_tolerance(start: tuple[float, float, float]) -> None:
    away, direction, yaw = start
    base = Base(SE2(GOAL.x + away * math.cos(direction), GOAL.y + away * math.sin(direction), yaw))
    seconds, status = approach(base)
    assert status is ControllerStatus.REACHED and seconds < 20.0
    assert base.pose.distance(GOAL) <= TOLERANCE.xy_tolerance
    assert abs(wrap(base.pose.yaw - GOAL.yaw)) <= TOLERANCE.yaw_tolerance


@settings(max_examples=50)
@given(st.floats(0.2, 0.34), st.floats(-0.3, 0.3), st.floats(-math.pi, math.pi))
def test_there_is_no_dance_at_the_goal(away: float, bearing: float, turn: float) -> None:
    """A robot that comes along its path drives the rest of it once, and turns to the goal's heading once."""
    goal = GOAL
    yaw = goal.yaw + turn
    base = Base(SE2(goal.x - away * math.cos(yaw + bearing), goal.y - away * math.sin(yaw + bearing), yaw))
    approach(base)
    assert base.driven <= away + 0.03
    assert base.turned <= 2.0 * abs(bearing) + abs(wrap(turn)) + 0.3


@pytest.mark.parametrize("seed", range(1, 40, 2))
def test_a_noisy_estimate_still_ends(seed: int) -> None:
    base = Base(SE2(GOAL.x - 0.3, GOAL.y, 0.0))
    _, status = approach(base, noise=0.003, seed=seed)
    assert status is ControllerStatus.REACHED and base.pose.distance(GOAL) < 0.03


def test_a_point_just_passed_is_reached_backwards() -> None:
    base = Base(GOAL @ SE2(MAX_REVERSE_DISTANCE - 0.02, 0.0, 0.0))
    approach(base)
    assert base.turned < 0.3


def test_an_obstacle_on_the_way_is_left_to_the_controller() -> None:
    cells = FREE.cells.copy()
    row, column = FREE.cell(GOAL.x - 0.15, GOAL.y)
    cells[row - 2 : row + 3, column] = INSCRIBED
    base = Base(SE2(GOAL.x - 0.33, GOAL.y, 0.0))
    _, status = approach(base, Costmap(cells, 0.05, -1.0, -2.5))
    assert status is ControllerStatus.BLOCKED and base.pose.distance(GOAL) > 0.15


class Never:
    """A controller that must not be called near the goal."""

    def set_path(self, path: np.ndarray, *, same_goal: bool = False) -> None:
        """Nothing to keep."""

    def command(self, *_: object) -> ControllerCommand:
        return ControllerCommand(0.1, 0.0, ControllerStatus.RUNNING)


def test_a_follower_uses_the_newest_pose_of_the_map() -> None:
    follower = PathFollower(Never(), lambda path, *_: path, PERIOD, FinalApproach(LIMITS, PERIOD))
    path = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    follower.set_path(path, SE2(0.0, 0.0, 0.0), following=False, tolerance=TOLERANCE)
    at_goal = SE2(0.3, 0.0, 0.0)
    follower.frame = SE2(0.1, 0.0, 0.0)  # localization has found out that the map is 10 cm ahead
    step = follower.step(at_goal, (0.0, 0.0), FREE, "")
    assert step.result is None and step.v > 0.0
    assert follower.step(SE2(0.4, 0.0, 0.0), (0.0, 0.0), FREE, "").result is not None


def test_only_the_final_approach_reports_such_a_goal_as_reached() -> None:
    class Content(Never):
        def command(self, *_: object) -> ControllerCommand:
            return ControllerCommand(0.0, 0.0, ControllerStatus.REACHED)

    follower = PathFollower(Content(), lambda path, *_: path, PERIOD, FinalApproach(LIMITS, PERIOD))
    path = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    follower.set_path(path, SE2(0.0, 0.0, 0.0), following=False, tolerance=TOLERANCE)
    taken = Costmap(np.full((80, 80), INSCRIBED, np.uint8), 0.05, -1.0, -2.5)
    taken.cells[taken.cell(0.24, 0.0)] = 0
    step = follower.step(SE2(0.24, 0.0, 0.0), (0.0, 0.0), taken, "")
    assert step.result is None and step.status is ControllerStatus.BLOCKED


def test_a_goal_without_tolerances_has_no_final_approach() -> None:
    follower = PathFollower(Never(), lambda path, *_: path, PERIOD, FinalApproach(LIMITS, PERIOD))
    path = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    follower.set_path(path, SE2(0.0, 0.0, 0.0), following=False)
    assert follower.step(SE2(0.3, 0.0, 0.0), (0.0, 0.0), FREE, "").v == 0.1
