"""Tests that a lost robot spins instead of following its path, and resumes when it is localized."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import NodeRunner, StationaryRobot

from chefbot.behavior.relocalization import LOCALIZED_UPDATES_REQUIRED, MAX_SPIN_STEPS
from chefbot.control.waiting_state import LOST
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, Twist
from chefbot.msgs.nav2_msgs import (
    BackUp,
    BackUp_Goal,
    BackUp_Result,
    ComputePathToPose,
    ComputePathToPose_Goal,
    ComputePathToPose_Result,
    FollowPath,
    FollowPath_Goal,
    FollowPath_Result,
    NavigateToPose,
    NavigateToPose_Goal,
    Spin,
    Spin_Goal,
    Spin_Result,
)
from chefbot.msgs.std_msgs import Header, String
from chefbot.nodes.navigation.tree_services import PATIENCE_EXCEEDED
from chefbot.ros2.rmw.action_client import new_goal_id
from chefbot.runtime.actions import action_server
from chefbot.runtime.coroutines import Future
from chefbot.runtime.node import Node, NoParams

GOAL = NavigateToPose_Goal(PoseStamped(Header.of(0, "map"), Pose.of(SE2(1.0, 0.0, 0.0))))


class FakeController(Node):
    """Planner and controller whose paths never end and whose spins take a second; it counts the spins."""

    params: NoParams
    compute_path_to_pose = action_server(ComputePathToPose)
    follow_path = action_server(FollowPath)
    spin = action_server(Spin)
    backup = action_server(BackUp)

    async def on_backup(self, _: BackUp_Goal, __: Any) -> BackUp_Result:
        return await Future[BackUp_Result]()

    def start(self) -> None:
        self.spins = 0

    async def on_compute_path_to_pose(self, _: ComputePathToPose_Goal, __: Any) -> ComputePathToPose_Result:
        return ComputePathToPose_Result()

    async def on_follow_path(self, _: FollowPath_Goal, __: Any) -> FollowPath_Result:
        return await Future[FollowPath_Result]()

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        self.spins += 1
        await self.sleep(1.0)
        return Spin_Result()


class NavigationWithGoal:
    """A navigator with a goal and a localization whose status the test publishes."""

    def __init__(self) -> None:
        self.runner = NodeRunner(
            {
                "navigator": "chefbot.nodes.navigator:NavigatorNode",
                "controller": "tests.nodes.test_lost_localization:FakeController",
            },
            {},
        )
        goal = NavigateToPose.send_goal(new_goal_id(), GOAL)
        self.runner.loop.publish("navigate_to_pose/_action/send_goal", goal, "client")
        self.runner.run(1.5)

    def publish_status(self, localized: bool, times: int = 1) -> None:
        for _ in range(times):
            self.runner.loop.publish("localization_status", LocalizationStatus(localized=localized), "amcl")
            self.runner.run(0.1)

    @property
    def controller(self) -> Any:
        return self.runner.system.nodes["controller"]

    @property
    def state(self) -> str:
        return str(self.runner.messages("navigation_status")[-1].state)


def test_without_localization_the_controller_does_not_wait() -> None:
    navigation = NavigationWithGoal()
    assert navigation.controller.follow_path.busy and not navigation.controller.spins


def test_a_lost_robot_aborts_the_path_spins_and_continues() -> None:
    navigation = NavigationWithGoal()
    navigation.publish_status(True)
    assert navigation.controller.follow_path.busy
    navigation.publish_status(False)
    assert (
        not navigation.controller.follow_path.busy
        and navigation.controller.spins == 1
        and navigation.state == "recovering"
    )
    navigation.runner.run(2.5)
    assert navigation.controller.spins == 3
    navigation.publish_status(True, LOCALIZED_UPDATES_REQUIRED)
    navigation.runner.run(1.5)
    assert navigation.controller.follow_path.busy and navigation.state == "driving"
    assert navigation.runner.messages("navigation_status")[-1].recoveries == 0, (
        "spinning to localize does not count as a recovery"
    )


def test_a_short_good_estimate_is_not_enough() -> None:
    navigation = NavigationWithGoal()
    navigation.publish_status(False)
    navigation.publish_status(True, LOCALIZED_UPDATES_REQUIRED - 1)
    navigation.publish_status(False)
    navigation.runner.run(3.0)
    assert not navigation.controller.follow_path.busy and navigation.controller.spins > 2


def test_failed_relocalization_aborts_the_goal_with_a_reason() -> None:
    navigation = NavigationWithGoal()
    navigation.publish_status(False)
    navigation.runner.run(MAX_SPIN_STEPS + 5.0)
    (outcome,) = navigation.runner.messages("navigate_to_pose/_action/get_result")
    assert outcome.result.error_code == PATIENCE_EXCEEDED and "Not localized" in outcome.result.error_msg
    assert navigation.controller.spins == MAX_SPIN_STEPS


def test_an_external_spin_is_not_interrupted() -> None:
    """Otherwise the spins of navigator and global localizer would preempt each other forever."""
    navigation = NavigationWithGoal()
    navigation.publish_status(False)
    for _ in range(3):
        turn = Spin.send_goal(new_goal_id(), Spin_Goal(1.0))
        navigation.runner.loop.publish("spin/_action/send_goal", turn, "client")
        navigation.runner.run(1.5)
    assert navigation.controller.spins <= 8 and navigation.state == "recovering"


def test_the_reason_of_a_stop_is_published_in_the_status() -> None:
    navigation = NavigationWithGoal()
    navigation.runner.loop.publish(
        "controller/wait_reason", String("The lidar is gone."), "controller", latched=True
    )
    navigation.runner.run(2.5)
    status = navigation.runner.messages("navigation_status")[-1]
    assert (status.state, status.reason) == ("waiting", "The lidar is gone.")
    navigation.runner.loop.publish("controller/wait_reason", String(""), "controller", latched=True)
    navigation.runner.run(0.1)
    assert (navigation.state, navigation.runner.messages("navigation_status")[-1].reason) == ("driving", "")


@pytest.mark.parametrize("name", ["follow_path", "spin"])
def test_a_lost_robot_follows_no_path_but_spins(name: str) -> None:
    robot = StationaryRobot()
    robot.loop.publish("localization_status", LocalizationStatus(localized=False), "amcl")
    robot.send_goal(name)
    robot.run(1.0)
    twists = [
        item.message
        for item in robot.published
        if item.topic == "cmd_vel_nav" and isinstance(item.message, Twist)
    ]
    assert any(twist.linear.x or twist.angular.z for twist in twists) == (name == "spin")
    assert [reason.data for reason in robot.messages("controller/wait_reason")] == (
        [LOST] if name == "follow_path" else []
    )


def test_a_lost_robot_does_not_back_up() -> None:
    """The recovery that backs up ends with the loss of localization, and does not begin during one."""
    navigation = NavigationWithGoal()
    node: Any = navigation.runner.system.nodes["navigator"]
    navigation.publish_status(True)
    backing = node.spawn(node._back_up(BackUp_Goal(Point(-0.2), 0.1, Duration.of(5.0))))
    navigation.runner.run(0.2)
    assert navigation.controller.backup.busy and not backing.done
    navigation.publish_status(False)
    assert backing.done and not navigation.controller.backup.busy
    backing = node.spawn(node._back_up(BackUp_Goal(Point(-0.2), 0.1, Duration.of(5.0))))
    navigation.runner.run(0.1)
    assert backing.done and not navigation.controller.backup.busy
