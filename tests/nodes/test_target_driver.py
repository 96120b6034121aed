"""Driving to a target that moves: when it is planned again, and when the robot gives up or looks round."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.nodes.navigation.target_driver import (
    PATIENCE,
    REPLAN_ANGLE,
    REPLAN_DISTANCE,
    TURNS,
    TargetDriverNode,
)
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams, every

NEAR, FAR = SE2(1.0, 0.0, 0.0), SE2(3.0, 1.0, 1.0)


class Driver(TargetDriverNode):
    """A node that drives where a test lets it."""

    params: NoParams

    @every(hz=10)
    def pass_time(self) -> None:
        """Let the time of the loop go on."""


class Servers(Node):
    """Plans in 0.1 s and follows in 2 s, with the error codes that a test sets; records all goals."""

    params: NoParams
    compute_path_to_pose = action_server(nav2.ComputePathToPose)
    follow_path = action_server(nav2.FollowPath)
    spin = action_server(nav2.Spin)

    def start(self) -> None:
        self.planned: list[SE2] = []
        self.followed: list[SE2] = []
        self.turned: list[float] = []
        self.plan_error = self.follow_error = 0

    async def on_compute_path_to_pose(
        self, goal: nav2.ComputePathToPose_Goal, _: Any
    ) -> nav2.ComputePathToPose_Result:
        assert goal.goal.header.frame_id == "odom"
        self.planned.append(goal.goal.pose.se2)
        await self.sleep(0.1)
        if self.plan_error:
            return nav2.ComputePathToPose_Result(error_code=self.plan_error, error_msg="No path.")
        return nav2.ComputePathToPose_Result(Path(goal.goal.header, (goal.goal,)))

    async def on_follow_path(self, goal: nav2.FollowPath_Goal, _: Any) -> nav2.FollowPath_Result:
        self.followed.append(goal.path.poses[-1].pose.se2)
        await self.sleep(2.0)
        return nav2.FollowPath_Result(error_code=self.follow_error, error_msg="Stuck.")

    async def on_spin(self, goal: nav2.Spin_Goal, _: Any) -> nav2.Spin_Result:
        self.turned.append(goal.target_yaw)
        await self.sleep(1.0)
        return nav2.Spin_Result()


class Drive(NodeRunner):
    """The driver with its servers."""

    def __init__(self) -> None:
        super().__init__({"driver": f"{__name__}:Driver", "servers": f"{__name__}:Servers"}, {})
        self.driver: Any = self.system.nodes["driver"]
        self.servers: Any = self.system.nodes["servers"]

    def to(self, target: SE2, seconds: float = 0.5) -> None:
        """Let the driver drive to a target, ten times a second."""
        for _ in range(round(10 * seconds)):
            self.driver._drive_to(target)
            self.run(0.1)

    def other_client(self, action: Any, goal: Any, name: str) -> None:
        message = action.send_goal(UUID(np.arange(16, dtype=np.uint8)), goal)
        self.loop.publish(f"{name}/_action/send_goal", message, "client")
        self.run(0.05)

    @property
    def cancelled(self) -> list[str]:
        return [one.topic.split("/")[0] for one in self.published if one.topic.endswith("cancel_goal")]


def close(poses: list[SE2], expected: list[SE2]) -> bool:
    return np.allclose(np.array(poses), np.array(expected))


def test_a_target_that_stands_is_planned_to_once() -> None:
    drive = Drive()
    drive.to(NEAR, 5.0)
    assert close(drive.servers.planned, [NEAR]) and close(drive.servers.followed, [NEAR])
    assert drive.driver._fault == "" and not drive.driver._diverted


@pytest.mark.parametrize(
    ("change", "again"),
    [
        (SE2(0.9 * REPLAN_DISTANCE, 0.0, 0.0), False),
        (SE2(0.0, -1.1 * REPLAN_DISTANCE, 0.0), True),
        (SE2(0.0, 0.0, 0.9 * REPLAN_ANGLE), False),
        (SE2(0.0, 0.0, -1.1 * REPLAN_ANGLE), True),
        (SE2(0.0, 0.0, 2.0 * math.pi - 0.9 * REPLAN_ANGLE), False),
    ],
)
def test_a_target_that_moved_is_planned_to_again(change: SE2, again: bool) -> None:
    drive = Drive()
    drive.to(NEAR)
    drive.to(SE2(NEAR.x + change.x, NEAR.y + change.y, NEAR.yaw + change.yaw))
    assert len(drive.servers.planned) == len(drive.servers.followed) == 1 + again
    assert drive.cancelled == [], "the new path takes the place of the old one without a stop"
    assert not drive.driver._diverted, "and that is not a goal of another client"


def test_a_slow_target_is_compared_with_the_last_plan() -> None:
    drive = Drive()
    for k in range(20):
        drive.to(SE2(1.0 + 0.06 * k, 0.0, 0.0), 0.3)
    assert close(drive.servers.planned, [SE2(1.0 + 0.18 * k, 0.0, 0.0) for k in range(7)])


def test_while_it_plans_it_requests_no_other_plan() -> None:
    drive = Drive()
    drive.driver._drive_to(NEAR)
    drive.driver._drive_to(FAR)
    drive.run(0.3)
    assert close(drive.servers.planned, [NEAR])
    drive.to(FAR)
    assert close(drive.servers.planned, [NEAR, FAR])


@pytest.mark.parametrize("errors", [{"plan_error": 208}, {"follow_error": 105}])
def test_it_tries_again_until_its_patience_ends(errors: dict[str, int]) -> None:
    drive = Drive()
    for name, code in errors.items():
        setattr(drive.servers, name, code)
    drive.to(NEAR, PATIENCE - 2.0)
    assert drive.driver._fault == "" and len(drive.servers.planned) > 4
    drive.to(NEAR, 8.0)
    assert drive.driver._fault == ("No path." if "plan_error" in errors else "Stuck.")


def test_a_path_that_was_followed_restores_the_patience() -> None:
    drive = Drive()
    for error in (105, 0) * 6:  # a failure every few seconds, 25 s in all
        drive.servers.follow_error = error
        drive.to(FAR if error else NEAR, 2.4)
    assert drive.driver._fault == ""
    drive.servers.plan_error = 208
    drive.to(FAR, PATIENCE + 4.0)
    assert drive.driver._fault == "No path."


def test_standing_cancels_the_plan_or_the_path() -> None:
    drive = Drive()
    drive.driver._drive_to(NEAR)
    drive.driver._stand()
    drive.run(3.0)
    assert drive.cancelled == ["compute_path_to_pose"] and drive.servers.followed == []
    drive.to(NEAR)
    drive.driver._stand()
    drive.driver._stand()
    drive.run(3.0)
    assert drive.cancelled == ["compute_path_to_pose", "follow_path"]
    assert drive.driver._fault == "" and not drive.driver._diverted
    drive.to(NEAR)
    assert len(drive.servers.followed) == 2, "the same target is planned to again"


def test_a_path_of_another_client_is_noted() -> None:
    drive = Drive()
    drive.to(NEAR)
    pose = PoseStamped(Header.of(0, "odom"), Pose.of(FAR))
    drive.other_client(nav2.FollowPath, nav2.FollowPath_Goal(Path(poses=(pose,))), "follow_path")
    assert drive.driver._diverted and drive.driver._fault == ""


@pytest.mark.slow
def test_a_planner_that_others_take_is_a_failure() -> None:
    drive = Drive()
    drive.driver._drive_to(NEAR)
    pose = PoseStamped(Header.of(0, "odom"), Pose.of(FAR))
    for _ in range(round(PATIENCE / 0.05) + 10):
        drive.driver._drive_to(NEAR)
        drive.other_client(nav2.ComputePathToPose, nav2.ComputePathToPose_Goal(pose), "compute_path_to_pose")
    assert drive.driver._fault == "Another goal preempted the planner." and drive.servers.followed == []


def test_looking_round_stands_and_turns_to_both_sides_and_back() -> None:
    drive = Drive()
    drive.to(NEAR)
    for _ in range(60):
        drive.driver._look_round()
        drive.run(0.1)
    assert drive.cancelled == ["follow_path"]
    assert drive.servers.turned == pytest.approx(TURNS) and sum(TURNS) == pytest.approx(0.0)
    drive.to(NEAR)
    drive.driver._look_round()
    drive.run(0.1)
    assert drive.servers.turned[3:] == [pytest.approx(TURNS[0])], "after a drive it looks round again"


def test_a_target_ends_the_looking_round() -> None:
    drive = Drive()
    drive.driver._look_round()
    drive.run(0.3)
    drive.to(NEAR)
    assert drive.cancelled == ["spin"] and close(drive.servers.followed, [NEAR])
    drive.driver._halt()
    drive.run(0.1)
    assert drive.cancelled == ["spin", "follow_path"]
