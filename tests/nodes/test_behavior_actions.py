"""Tests that Spin, BackUp and DriveOnHeading have the behavior, feedback and error codes of Nav2."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.nodes import GOALS, NodeRunner, StationaryRobot, commanded_speeds, send_goal_and_run

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
    robot = StationaryRobot()
    send_goal_and_run(robot, "backup", BackUp_Goal(Point(metres), speed))
    assert min(commanded_speeds(robot)) < 0.0 and max(commanded_speeds(robot)) <= 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_drive_on_heading_follows_the_sign(sign: float) -> None:
    robot = StationaryRobot()
    send_goal_and_run(robot, "drive_on_heading", DriveOnHeading_Goal(Point(0.3 * sign), 0.1 * sign))
    assert (
        max(v * sign for v in commanded_speeds(robot)) > 0.0
        and min(v * sign for v in commanded_speeds(robot)) >= 0.0
    )


@pytest.mark.parametrize(
    ("name", "goal"),
    [
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3), -0.1)),
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3, 0.1), 0.1)),
        ("backup", BackUp_Goal(Point(0.3, 0.0, 0.1), 0.1)),
    ],
)
def test_invalid_motions_fail_with_the_nav2_error_code(name: str, goal: object) -> None:
    robot = StationaryRobot()
    send_goal_and_run(robot, name, goal)
    (outcome,) = robot.results(name)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, INVALID[name])
    assert not any(commanded_speeds(robot))


@pytest.mark.parametrize(
    ("name", "goal"),
    [
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3), 0.1, SHORT)),
        ("backup", BackUp_Goal(Point(0.3), 0.1, SHORT)),
        ("spin", Spin_Goal(1.0, SHORT)),
    ],
)
def test_a_timeout_has_the_nav2_error_code(name: str, goal: object) -> None:
    robot = StationaryRobot()  # it does not move, whatever is commanded
    send_goal_and_run(robot, name, goal)
    (outcome,) = robot.results(name)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, TIMEOUT[name])
    assert outcome.result.total_elapsed_time.seconds == pytest.approx(0.5, abs=0.25)
    feedback = [message.feedback for message in robot.messages(f"{name}/_action/feedback")]
    values = {value for item in feedback for value in msgspec.to_builtins(item).values()}
    assert len(feedback) >= 4 and values == {0.0}


def test_a_new_motion_preempts_the_current_one() -> None:
    robot = StationaryRobot()
    send_goal_and_run(robot, "spin", Spin_Goal(3.0), 0.5)
    send_goal_and_run(robot, "backup", BackUp_Goal(Point(0.3), 0.1, SHORT))
    assert [result.status for result in robot.results("spin")] == [STATUS_CANCELED]
    assert robot.results("backup")[0].result.error_code == TIMEOUT["backup"]
    controller = robot.system.nodes["controller"]
    assert isinstance(controller, ControllerNode) and not controller.spin.busy and not controller.backup.busy


def test_follow_path_feedback_has_distance_and_speed() -> None:
    robot = StationaryRobot()
    path = tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.1 * i, 0.0, 0.0))) for i in range(21))
    send_goal_and_run(robot, "follow_path", FollowPath_Goal(Path(Header.of(0, "odom"), path)), 2.0)
    feedback = [message.feedback for message in robot.messages("follow_path/_action/feedback")]
    assert len(feedback) > 10
    assert all(item.distance_to_goal == pytest.approx(2.0, abs=0.05) for item in feedback), "it does not move"
    assert max(item.speed for item in feedback) > 0.0


def test_the_local_plan_is_published_while_following_a_path() -> None:
    robot = StationaryRobot()
    robot.run(1.0)
    assert not robot.messages("local_plan")
    path = tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.1 * i, 0.0, 0.0))) for i in range(21))
    send_goal_and_run(robot, "follow_path", FollowPath_Goal(Path(Header.of(0, "odom"), path)), 2.0)
    plans = robot.messages("local_plan")
    assert 8 <= len(plans) <= 10, "five times a second"
    assert all(plan.header.frame_id == "odom" and len(plan.poses) > 5 for plan in plans)
    assert plans[-1].array[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert plans[-1].array[-1, 0] > 0.1 and abs(plans[-1].array[-1, 1]) < 0.1
    compared = robot.messages("trajectory_candidates")[-1]
    best = int(np.argmin(compared.scores))
    assert len(compared.scores) > 50 and compared.linear[best] > 0.1 and abs(compared.angular[best]) < 0.05
    assert compared.pose.se2 == pytest.approx((0.0, 0.0, 0.0), abs=1e-6) and compared.duration > 1.0
    assert len(robot.messages("trajectory_candidates")) == len(plans)
    robot.request_stop(True)
    robot.run(1.0)
    assert len(robot.messages("local_plan")) == len(plans)


class ConstantFeedback(Node):
    """A planner and controller that report 5 m at 0.25 m/s for three seconds."""

    params: NoParams
    compute_path_to_pose = action_server(ComputePathToPose)
    follow_path = action_server(FollowPath)

    async def on_compute_path_to_pose(self, _: ComputePathToPose_Goal, __: Any) -> ComputePathToPose_Result:
        """Return an empty path."""
        return ComputePathToPose_Result()

    async def on_follow_path(
        self, _: FollowPath_Goal, feedback: Callable[[FollowPath_Feedback], None]
    ) -> FollowPath_Result:
        """Report the same distance and speed at 10 Hz."""
        for _step in range(30):
            feedback(FollowPath_Feedback(5.0, 0.25))
            await self.sleep(0.1)
        return FollowPath_Result()


def test_navigation_feedback_is_published_twice_a_second() -> None:
    kinds = {
        "navigator": "chefbot.nodes.navigator:NavigatorNode",
        "controller": "tests.nodes.test_behavior_actions:ConstantFeedback",
    }
    runner = NodeRunner(kinds, {})
    goal = NavigateToPose_Goal(PoseStamped(Header.of(0, "map"), Pose.of(SE2(1.0, 0.0, 0.0))))
    action, _ = GOALS["navigate_to_pose"]
    runner.loop.publish("navigate_to_pose/_action/send_goal", action.send_goal(new_goal_id(), goal), "client")
    runner.run(2.6)
    feedback = [message.feedback for message in runner.messages("navigate_to_pose/_action/feedback")]
    assert 4 <= len(feedback) <= 7
    assert (feedback[-1].distance_remaining, feedback[-1].estimated_time_remaining.seconds) == (5.0, 20.0)
    assert feedback[-1].navigation_time.seconds == pytest.approx(2.5, abs=0.3)
