"""Spin, BackUp and DriveOnHeading mean and answer what Nav2's behaviours do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec
import pytest
from tests.support.nodes import ORDERS, Life, Robot, ordered, speeds

from chefbot.maths.se2 import SE2
from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_CANCELED
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped
from chefbot.msgs.nav2_msgs import (
    BackUp_Goal,
    ComputePathToPose,
    ComputePathToPose_Goal,
    ComputePathToPose_Result,
    DriveOnHeading_Goal,
    FollowPath,
    FollowPath_Feedback,
    FollowPath_Goal,
    FollowPath_Result,
    NavigateToPose_Goal,
    Spin_Goal,
)
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.controller import ControllerNode
from chefbot.ros2.rmw.action_client import new_goal_id
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams

INVALID = {"backup": 713, "drive_on_heading": 724}
TIMEOUT = {"backup": 711, "drive_on_heading": 721, "spin": 701}
SHORT = Duration.of(0.5)


@pytest.mark.parametrize("metres", [0.3, -0.3])
@pytest.mark.parametrize("speed", [0.1, -0.1])
def test_backup_is_backwards_for_any_sign(metres: float, speed: float) -> None:
    robot = Robot()
    ordered(robot, "backup", BackUp_Goal(Point(metres), speed))
    assert min(speeds(robot)) < 0.0 and max(speeds(robot)) <= 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_drive_on_heading_follows_the_sign(sign: float) -> None:
    robot = Robot()
    ordered(robot, "drive_on_heading", DriveOnHeading_Goal(Point(0.3 * sign), 0.1 * sign))
    assert max(one * sign for one in speeds(robot)) > 0.0 and min(one * sign for one in speeds(robot)) >= 0.0


@pytest.mark.parametrize(
    ("name", "goal"),
    [
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3), -0.1)),
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3, 0.1), 0.1)),
        ("backup", BackUp_Goal(Point(0.3, 0.0, 0.1), 0.1)),
    ],
)
def test_invalid_motions_fail_with_the_nav2_error_code(name: str, goal: object) -> None:
    robot = Robot()
    ordered(robot, name, goal)
    (outcome,) = robot.outcomes(name)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, INVALID[name])
    assert not any(speeds(robot))


@pytest.mark.parametrize(
    ("name", "goal"),
    [
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3), 0.1, SHORT)),
        ("backup", BackUp_Goal(Point(0.3), 0.1, SHORT)),
        ("spin", Spin_Goal(1.0, SHORT)),
    ],
)
def test_a_timeout_has_the_nav2_error_code(name: str, goal: object) -> None:
    robot = Robot()  # it stands whatever it is told
    ordered(robot, name, goal)
    (outcome,) = robot.outcomes(name)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, TIMEOUT[name])
    assert outcome.result.total_elapsed_time.seconds == pytest.approx(0.5, abs=0.25)
    told = [one.feedback for one in robot.heard(f"{name}/_action/feedback")]
    assert len(told) >= 4 and {value for one in told for value in msgspec.to_builtins(one).values()} == {0.0}


def test_a_new_motion_preempts_the_current_one() -> None:
    robot = Robot()
    ordered(robot, "spin", Spin_Goal(3.0), 0.5)
    ordered(robot, "backup", BackUp_Goal(Point(0.3), 0.1, SHORT))
    assert [one.status for one in robot.outcomes("spin")] == [STATUS_CANCELED]
    assert robot.outcomes("backup")[0].result.error_code == TIMEOUT["backup"]
    controller = robot.system.nodes["controller"]
    assert isinstance(controller, ControllerNode) and not controller.spin.busy and not controller.backup.busy


def test_follow_path_feedback_has_distance_and_speed() -> None:
    robot = Robot()
    path = tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.1 * i, 0.0, 0.0))) for i in range(21))
    ordered(robot, "follow_path", FollowPath_Goal(Path(Header.of(0, "odom"), path)), 2.0)
    told = [one.feedback for one in robot.heard("follow_path/_action/feedback")]
    assert len(told) > 10
    assert all(one.distance_to_goal == pytest.approx(2.0, abs=0.05) for one in told), "it stands"
    assert max(one.speed for one in told) > 0.0


def test_the_local_plan_is_published_while_following_a_path() -> None:
    robot = Robot()
    robot.run(1.0)
    assert not robot.heard("local_plan")
    path = tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.1 * i, 0.0, 0.0))) for i in range(21))
    ordered(robot, "follow_path", FollowPath_Goal(Path(Header.of(0, "odom"), path)), 2.0)
    plans = robot.heard("local_plan")
    assert 8 <= len(plans) <= 10, "five times a second"
    assert all(plan.header.frame_id == "odom" and len(plan.poses) > 5 for plan in plans)
    assert plans[-1].array[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert plans[-1].array[-1, 0] > 0.1 and abs(plans[-1].array[-1, 1]) < 0.1
    robot.press(True)
    robot.run(1.0)
    assert len(robot.heard("local_plan")) == len(plans)


class Halfway(Node):
    """Plans nothing and drives for three seconds; half of the way is left, at a pace of its own."""

    params: NoParams
    compute_path_to_pose = action_server(ComputePathToPose)
    follow_path = action_server(FollowPath)

    async def on_compute_path_to_pose(self, _: ComputePathToPose_Goal, __: Any) -> ComputePathToPose_Result:
        """Some path."""
        return ComputePathToPose_Result()

    async def on_follow_path(
        self, _: FollowPath_Goal, feedback: Callable[[FollowPath_Feedback], None]
    ) -> FollowPath_Result:
        """Ten times a second how far it is."""
        for _step in range(30):
            feedback(FollowPath_Feedback(5.0, 0.25))
            await self.sleep(0.1)
        return FollowPath_Result()


def test_navigation_feedback_is_published_twice_a_second() -> None:
    kinds = {
        "navigator": "chefbot.nodes.navigator:NavigatorNode",
        "driver": "tests.nodes.test_motions:Halfway",
    }
    life = Life(kinds, {})
    goal = NavigateToPose_Goal(PoseStamped(Header.of(0, "map"), Pose.of(SE2(1.0, 0.0, 0.0))))
    action, _ = ORDERS["navigate_to_pose"]
    life.loop.publish("navigate_to_pose/_action/send_goal", action.send_goal(new_goal_id(), goal), "somebody")
    life.run(2.6)
    told = [one.feedback for one in life.heard("navigate_to_pose/_action/feedback")]
    assert 4 <= len(told) <= 7
    assert (told[-1].distance_remaining, told[-1].estimated_time_remaining.seconds) == (5.0, 20.0)
    assert told[-1].navigation_time.seconds == pytest.approx(2.5, abs=0.3)
