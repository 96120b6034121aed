"""A robot that does not know where it is drives no path: it turns on the spot, and goes on when it knows."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import Life, Robot

from chefbot.behavior.relocalization import LOCALIZED_UPDATES_REQUIRED, MAX_SPIN_STEPS
from chefbot.control.waiting_state import LOST
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, Twist
from chefbot.msgs.nav2_msgs import (
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
from chefbot.nodes.navigator import PATIENCE_EXCEEDED
from chefbot.ros2.rmw.action_client import new_goal_id
from chefbot.runtime.actions import action_server
from chefbot.runtime.coroutines import Future
from chefbot.runtime.node import Node, NoParams

GOAL = NavigateToPose_Goal(PoseStamped(Header.of(0, "map"), Pose.of(SE2(1.0, 0.0, 0.0))))


class Legs(Node):
    """Plans and follows without an end; notes what it is asked for. A turn takes a second."""

    params: NoParams
    compute_path_to_pose = action_server(ComputePathToPose)
    follow_path = action_server(FollowPath)
    spin = action_server(Spin)

    def start(self) -> None:
        self.turns = 0

    async def on_compute_path_to_pose(self, _: ComputePathToPose_Goal, __: Any) -> ComputePathToPose_Result:
        return ComputePathToPose_Result()

    async def on_follow_path(self, _: FollowPath_Goal, __: Any) -> FollowPath_Result:
        return await Future[FollowPath_Result]()

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        self.turns += 1
        await self.sleep(1.0)
        return Spin_Result()


class Lost:
    """A navigator with a goal, and what localization says."""

    def __init__(self) -> None:
        self.life = Life(
            {
                "navigator": "chefbot.nodes.navigator:NavigatorNode",
                "legs": "tests.nodes.test_lost_localization:Legs",
            },
            {},
        )
        goal = NavigateToPose.send_goal(new_goal_id(), GOAL)
        self.life.loop.publish("navigate_to_pose/_action/send_goal", goal, "somebody")
        self.life.run(1.5)

    def say(self, localized: bool, times: int = 1) -> None:
        for _ in range(times):
            self.life.loop.publish("localization_status", LocalizationStatus(localized=localized), "amcl")
            self.life.run(0.1)

    @property
    def legs(self) -> Any:
        return self.life.system.nodes["legs"]

    @property
    def state(self) -> str:
        return str(self.life.heard("navigation_status")[-1].state)


def test_without_localization_the_controller_does_not_wait() -> None:
    lost = Lost()
    assert lost.legs.follow_path.busy and not lost.legs.turns


def test_a_lost_robot_aborts_the_path_spins_and_continues() -> None:
    lost = Lost()
    lost.say(True)
    assert lost.legs.follow_path.busy
    lost.say(False)
    assert not lost.legs.follow_path.busy and lost.legs.turns == 1 and lost.state == "recovering"
    lost.life.run(2.5)
    assert lost.legs.turns == 3
    lost.say(True, LOCALIZED_UPDATES_REQUIRED)
    lost.life.run(1.5)
    assert lost.legs.follow_path.busy and lost.state == "driving"
    assert lost.life.heard("navigation_status")[-1].recoveries == 0, "to look around is no recovery"


def test_a_short_good_estimate_is_not_enough() -> None:
    lost = Lost()
    lost.say(False)
    lost.say(True, LOCALIZED_UPDATES_REQUIRED - 1)
    lost.say(False)
    lost.life.run(3.0)
    assert not lost.legs.follow_path.busy and lost.legs.turns > 2


def test_failed_relocalization_aborts_the_goal_with_a_reason() -> None:
    lost = Lost()
    lost.say(False)
    lost.life.run(MAX_SPIN_STEPS + 5.0)
    (outcome,) = lost.life.heard("navigate_to_pose/_action/get_result")
    assert outcome.result.error_code == PATIENCE_EXCEEDED and "Not localized" in outcome.result.error_msg
    assert lost.legs.turns == MAX_SPIN_STEPS


def test_an_external_spin_is_not_interrupted() -> None:
    """Such as the finder's: the two do not push each other aside for ever."""
    lost = Lost()
    lost.say(False)
    for _ in range(3):
        turn = Spin.send_goal(new_goal_id(), Spin_Goal(1.0))
        lost.life.loop.publish("spin/_action/send_goal", turn, "somebody")
        lost.life.run(1.5)
    assert lost.legs.turns <= 8 and lost.state == "recovering"


def test_the_reason_to_stand_is_what_the_controller_waits_for() -> None:
    lost = Lost()
    lost.life.loop.publish("controller/standing", String("The lidar is gone."), "controller", latched=True)
    lost.life.run(2.5)
    status = lost.life.heard("navigation_status")[-1]
    assert (status.state, status.reason) == ("waiting", "The lidar is gone.")
    lost.life.loop.publish("controller/standing", String(""), "controller", latched=True)
    lost.life.run(0.1)
    assert (lost.state, lost.life.heard("navigation_status")[-1].reason) == ("driving", "")


@pytest.mark.parametrize("name", ["follow_path", "spin"])
def test_a_lost_robot_follows_no_path_but_spins(name: str) -> None:
    robot = Robot()
    robot.loop.publish("localization_status", LocalizationStatus(localized=False), "amcl")
    robot.order(name)
    robot.run(1.0)
    twists = [
        one.message for one in robot.said if one.topic == "cmd_vel_nav" and isinstance(one.message, Twist)
    ]
    assert any(one.linear.x or one.angular.z for one in twists) == (name == "spin")
    assert [one.data for one in robot.heard("controller/standing")] == (
        [LOST] if name == "follow_path" else []
    )
