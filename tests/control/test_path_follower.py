"""The path follower: detours, blocked and stuck robots, and the trajectory that it chose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.controller import ControllerCommand, ControllerStatus
from chefbot.control.path_follower import BLOCKED_TIMEOUT, FollowPathError, PathFollower
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

PERIOD = 0.1
ORIGIN, STANDSTILL = SE2(0.0, 0.0, 0.0), (0.0, 0.0)
COSTS = Costmap(np.zeros((4, 4), np.uint8), 0.05, 0.0, 0.0)
LIMITS = Limits.of(load_robot("chefbot"))
RUNNING, BLOCKED, REACHED = ControllerStatus.RUNNING, ControllerStatus.BLOCKED, ControllerStatus.REACHED


class GivenPath(NamedTuple):
    end: float
    same_goal: bool


class ScriptedController:
    """Commands what `answer` holds, and notes the paths that it was given."""

    def __init__(self) -> None:
        self.answer = ControllerCommand(0.2, 0.1, RUNNING)
        self.paths: list[GivenPath] = []

    def set_path(self, path: np.ndarray, *, same_goal: bool = False) -> None:
        self.paths.append(GivenPath(float(path[-1, 0]), same_goal))

    def command(self, *_: object) -> ControllerCommand:
        return self.answer


def line(end: float) -> np.ndarray:
    x = np.linspace(0.0, end, 11)
    return np.column_stack([x, 0.0 * x, 0.0 * x])


@pytest.fixture
def controller() -> ScriptedController:
    return ScriptedController()


@pytest.fixture
def follower(controller: ScriptedController) -> PathFollower:
    follower = PathFollower(controller, lambda path, *_: path, PERIOD)
    follower.set_path(line(2.0), ORIGIN, following=False)
    return follower


def cycles(seconds: float) -> int:
    return round(seconds / PERIOD)


def test_the_path_is_placed_in_the_frame_of_the_costmap(controller: ScriptedController) -> None:
    follower = PathFollower(controller, lambda path, *_: path, PERIOD)
    assert follower.set_path(line(1.0), SE2(1.0, 2.0, np.pi / 2), following=False)
    assert follower.path[-1] == pytest.approx([1.0, 3.0, np.pi / 2])


@pytest.mark.parametrize(
    ("end", "following", "new"), [(2.0, True, False), (2.0, False, True), (3.0, True, True)]
)
def test_only_another_goal_restarts_the_checks(
    follower: PathFollower, controller: ScriptedController, end: float, following: bool, new: bool
) -> None:
    controller.answer = ControllerCommand(0.0, 0.0, BLOCKED)
    for _ in range(cycles(BLOCKED_TIMEOUT) - 1):
        assert follower.step(ORIGIN, STANDSTILL, COSTS, "").result is None
    assert follower.set_path(line(end), ORIGIN, following=following) == new
    assert controller.paths[-1] == (end, not new)
    results = [follower.step(ORIGIN, STANDSTILL, COSTS, "").result for _ in range(2)]
    assert (results[-1] is None) == new


def test_a_detour_is_followed_until_the_path_is_free_again(controller: ScriptedController) -> None:
    detour, use = line(2.5), [False]
    follower = PathFollower(controller, lambda path, *_: detour if use[0] else path, PERIOD)
    follower.set_path(line(2.0), ORIGIN, following=False)
    for use[0], count in ((True, 2), (True, 2), (False, 3)):
        follower.step(ORIGIN, STANDSTILL, COSTS, "")
        assert len(controller.paths) == count
    assert controller.paths[1:] == [(2.5, True), (2.0, True)]


def test_a_reached_goal_ends_without_an_error(follower: PathFollower, controller: ScriptedController) -> None:
    controller.answer = ControllerCommand(0.0, 0.0, REACHED)
    result = follower.step(ORIGIN, STANDSTILL, COSTS, "").result
    assert result is not None and not result.error_code


def test_a_robot_that_does_not_move_is_stuck_unless_it_waits(follower: PathFollower) -> None:
    for _ in range(cycles(30.0)):
        follower.pause()
        assert follower.step(ORIGIN, STANDSTILL, COSTS, "").result is None
    results = [follower.step(ORIGIN, STANDSTILL, COSTS, "").result for _ in range(cycles(9.0))]
    assert results[0] is None and results[-1] is not None
    assert results[-1].error_code == FollowPathError.STUCK


def test_blindness_forbids_forward_only(follower: PathFollower, controller: ScriptedController) -> None:
    step = follower.step(ORIGIN, STANDSTILL, COSTS, "Blind.")
    assert (step.v, step.w, step.speed) == (0.0, 0.1, 0.2)
    controller.answer = ControllerCommand(-0.1, 0.1, RUNNING)
    assert follower.step(ORIGIN, STANDSTILL, COSTS, "Blind.").v == -0.1


@given(st.lists(st.sampled_from([(RUNNING, ""), (RUNNING, "Blind."), (BLOCKED, "")]), max_size=80))
def test_it_fails_as_blocked_after_three_seconds_in_a_row(events: list[tuple[ControllerStatus, str]]) -> None:
    controller = ScriptedController()
    follower = PathFollower(controller, lambda path, *_: path, PERIOD)
    follower.set_path(line(2.0), ORIGIN, following=False)
    count = 0
    for i, (status, blind) in enumerate(events):
        controller.answer = ControllerCommand(0.2, 0.0, status)
        result = follower.step(SE2(0.2 * i, 0.0, 0.0), STANDSTILL, COSTS, blind).result
        count = count + 1 if blind or status is BLOCKED else 0
        failed = result is not None and result.error_code == FollowPathError.NO_VALID_CONTROL
        assert (
            failed == (count * PERIOD >= BLOCKED_TIMEOUT - 1e-9) or abs(count - cycles(BLOCKED_TIMEOUT)) <= 1
        )
        if failed and blind:
            assert result is not None and result.error_msg == blind


def test_another_controller_gets_the_current_path(follower: PathFollower) -> None:
    other = ScriptedController()
    follower.replace_controller(other)
    assert other.paths == [(2.0, False)]


def test_the_trajectory_is_that_of_the_latest_command(
    follower: PathFollower, controller: ScriptedController
) -> None:
    assert follower.trajectory(LIMITS, 1.5) is None
    controller.answer = ControllerCommand(0.2, 0.0, RUNNING)
    follower.step(ORIGIN, (0.2, 0.0), COSTS, "")
    trajectory = follower.trajectory(LIMITS, 1.5)
    assert trajectory is not None
    assert trajectory[0] == pytest.approx([0.0, 0.0, 0.0]) and trajectory[-1] == pytest.approx(
        [0.3, 0.0, 0.0]
    )
    follower.pause()
    assert follower.trajectory(LIMITS, 1.5) is None
