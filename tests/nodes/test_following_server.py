"""Following a person by the actions of a planner and a controller."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_CANCELED, STATUS_SUCCEEDED
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import FollowOrder, NavigationStatus
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, PoseStamped, TransformStamped
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Bool, Empty
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.nodes.navigation.mission_node import OUTCOME_TIME
from chefbot.people.following import FAILED_TO_CONTROL, FAILED_TO_DETECT_OBJECT, GOAL_REJECTED, TF_ERROR
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams


class StraightDriver(Node):
    """Plans straight lines and drives along them at 0.5 m/s; rotates as long as that is requested."""

    params: NoParams
    compute_path_to_pose = action_server(nav2.ComputePathToPose)
    follow_path = action_server(nav2.FollowPath)
    spin = action_server(nav2.Spin)
    finds_paths = True

    def start(self) -> None:
        self.pose = SE2(0.0, 0.0, 0.0)
        self.turns = 0
        self._publish_pose()

    async def on_compute_path_to_pose(
        self, goal: nav2.ComputePathToPose_Goal, _: Any
    ) -> nav2.ComputePathToPose_Result:
        await self.sleep(0.05)
        if not self.finds_paths:
            return nav2.ComputePathToPose_Result(error_code=208, error_msg="no path leads there")
        return nav2.ComputePathToPose_Result(Path(goal.goal.header, (goal.goal,)))

    async def on_follow_path(self, goal: nav2.FollowPath_Goal, _: Any) -> nav2.FollowPath_Result:
        end: SE2 = goal.path.poses[-1].pose.se2
        while (away := self.pose.distance(end)) > 0.05:
            share = min(1.0, 0.05 / away)
            x, y = self.pose.x + share * (end.x - self.pose.x), self.pose.y + share * (end.y - self.pose.y)
            self.pose = SE2(x, y, end.yaw)
            self._publish_pose()
            await self.sleep(0.1)
        self.pose = SE2(self.pose.x, self.pose.y, end.yaw)
        self._publish_pose()
        return nav2.FollowPath_Result()

    async def on_spin(self, _: nav2.Spin_Goal, __: Any) -> nav2.Spin_Result:
        self.turns += 1
        await self.sleep(2.0)
        return nav2.Spin_Result()

    def _publish_pose(self) -> None:
        self.publish("tf", TFMessage((TransformStamped.of(self.now_ns, "odom", "base_link", self.pose),)))


class Following(NodeRunner):
    """A driver, the following server, and one person with number 7."""

    def __init__(self) -> None:
        kinds = {
            "driver": "tests.nodes.test_following_server:StraightDriver",
            "follower": "chefbot.nodes.navigation.following_server:FollowingServerNode",
        }
        super().__init__(kinds, {})
        self.driver: Any = self.system.nodes["driver"]

    def send(self, frame: str = "person_7", *, topic: str = "", seconds: float = 0.0) -> None:
        goal = nav2.FollowObject_Goal(topic, frame, Duration.of(seconds))
        goal_id = UUID(np.arange(16, dtype=np.uint8))
        message = nav2.FollowObject.send_goal(goal_id, goal)
        self.loop.publish("follow_object/_action/send_goal", message, "client")

    def walk(self, where: Callable[[float], tuple[float, float]], seconds: float) -> list[float]:
        """Let the person be at where(t), x and y in m, for a time; return the distances to the robot."""
        distances = []
        for k in range(round(seconds / 0.1)):
            x, y = where(0.1 * k)
            self.show((7, x, y))
            self.run(0.1)
            distances.append(self.driver.pose.distance(SE2(x, y, 0.0)))
        return distances

    def show(self, *persons: tuple[int, float, float]) -> None:
        shown = tuple(TrackedPerson(number, Point(x, y), visible=True) for number, x, y in persons)
        self.loop.publish("tracked_people", TrackedPeople(people=shown), "tracker", from_device=True)

    @property
    def outcome(self) -> Any:
        outcomes = self.messages("follow_object/_action/get_result")
        return outcomes[-1] if outcomes else None

    @property
    def phase(self) -> str:
        return self.messages("phase")[-1].data


def test_a_walking_person_is_followed_at_a_metre() -> None:
    robot = Following()
    robot.show((7, 1.5, 0.0))
    robot.send()
    distances = robot.walk(lambda t: (1.5 + 0.3 * t, 0.2 * t), 20.0)
    assert robot.outcome is None and max(distances[50:]) < 1.8 and min(distances) > 0.9
    robot.walk(lambda _: (7.5, 4.0), 10.0)
    assert robot.driver.pose.distance(SE2(7.5, 4.0, 0.0)) == pytest.approx(1.0, abs=0.3)
    assert robot.phase == "Person 7 stands; waiting."


def test_a_lost_person_ends_with_an_error_after_looking_round() -> None:
    robot = Following()
    robot.show((7, 2.0, 0.0))
    robot.send()
    robot.walk(lambda t: (2.0 + 0.3 * t, 0.0), 5.0)
    robot.show()
    robot.run(40.0)
    assert robot.outcome.status == STATUS_ABORTED and robot.driver.turns == 3
    assert (robot.outcome.result.error_code, robot.outcome.result.num_retries) == (FAILED_TO_DETECT_OBJECT, 1)
    phases = [one.data for one in robot.messages("phase")]
    assert "Lost person 7; looking around." in phases
    states = {one.feedback.state for one in robot.messages("follow_object/_action/feedback")}
    assert {nav2.CONTROLLING, nav2.RETRY} <= states


def test_the_duration_of_a_goal_ends_it_with_success() -> None:
    robot = Following()
    robot.show((7, 1.5, 0.0))
    robot.send("", seconds=5.0)
    robot.walk(lambda _: (3.0, 0.0), 8.0)
    assert robot.outcome.status == STATUS_SUCCEEDED
    assert robot.outcome.result.total_elapsed_time.seconds == pytest.approx(5.0, abs=0.3)


def end_by(robot: Following, topic: str, message: Any) -> Any:
    robot.show((7, 3.0, 0.0))
    robot.loop.publish("follow_order", FollowOrder(7), "page", from_device=True)
    robot.walk(lambda _: (6.0, 0.0), 2.0)
    assert robot.outcome is None and robot.driver.pose.x > 0.5
    robot.loop.publish(topic, message, "client", from_device=True)
    robot.run(0.5)
    x = robot.driver.pose.x
    robot.run(2.0)
    assert robot.driver.pose.x == x  # it stands
    return robot.outcome


@pytest.mark.parametrize(
    ("topic", "message"),
    [("cancel", Empty()), ("emergency_stop", Bool(True)), ("navigation_goal", PoseStamped())],
)
def test_operators_and_other_goals_end_the_following(topic: str, message: Any) -> None:
    robot = Following()
    assert end_by(robot, topic, message).status == STATUS_CANCELED
    ended = {"emergency_stop": "The emergency stop ended the following."}
    assert robot.phase == ended.get(topic, "Following was cancelled.")
    robot.run(OUTCOME_TIME)
    assert robot.phase == ""


def test_a_path_of_another_client_ends_the_following() -> None:
    path = nav2.FollowPath.send_goal(
        UUID(np.ones(16, np.uint8)), nav2.FollowPath_Goal(Path(poses=(PoseStamped(),)))
    )
    robot = Following()
    robot.show((7, 3.0, 0.0))
    robot.send()
    robot.walk(lambda _: (6.0, 0.0), 2.0)
    robot.loop.publish("follow_path/_action/send_goal", path, "navigator")
    robot.run(0.5)
    assert robot.outcome.status == STATUS_CANCELED


@pytest.mark.parametrize(
    ("frame", "topic", "reason"),
    [("base_link", "", "follows tracked people"), ("", "some_pose", "follows tracked people")],
)
def test_other_objects_are_refused_with_a_reason(frame: str, topic: str, reason: str) -> None:
    robot = Following()
    robot.send(frame, topic=topic)
    robot.run(0.5)
    assert robot.outcome.result.error_code == GOAL_REJECTED and reason in robot.outcome.result.error_msg


@pytest.mark.parametrize(
    ("message", "reason"),
    [(NavigationStatus(state="driving"), "cancel it first"), (Bool(True), "emergency stop is active")],
)
def test_a_robot_that_may_not_follow_refuses(message: Any, reason: str) -> None:
    robot = Following()
    topic = "emergency_stop" if isinstance(message, Bool) else "navigation_status"
    robot.loop.publish(topic, message, "robot")
    robot.send()
    robot.run(0.5)
    assert robot.outcome.result.error_code == GOAL_REJECTED and reason in robot.outcome.result.error_msg


def test_a_robot_without_path_or_pose_aborts_with_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StraightDriver, "finds_paths", False)
    robot = Following()
    robot.show((7, 3.0, 0.0))
    robot.send()
    robot.walk(lambda _: (3.0, 0.0), 20.0)
    assert robot.outcome.result.error_code == FAILED_TO_CONTROL
    assert robot.outcome.result.error_msg == "no path leads there"
    robot.system.transforms.clear()
    robot.send()
    robot.run(0.5)
    assert robot.outcome.result.error_code == TF_ERROR
