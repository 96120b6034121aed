"""Waypoints and poses to drive through, by the actions of a navigator."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import ROOM, NodeRunner

from chefbot.behavior.waypoints import NO_VALID_WAYPOINTS, STOP_ON_MISSED_WAYPOINT, UNKNOWN
from chefbot.maths.se2 import SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_CANCELED, STATUS_SUCCEEDED
from chefbot.msgs.chefbot_msgs import PatrolOrder
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav_msgs import Goals
from chefbot.msgs.std_msgs import Empty, Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams
from chefbot.safety.emergency_stop import REFUSED

SPEED = 0.5


class LineNavigator(Node):
    """Drives along x at SPEED; to negative x no path leads, and beyond 100 m the emergency stop is pressed."""

    params: NoParams
    navigate_to_pose = action_server(nav2.NavigateToPose)

    def start(self) -> None:
        self.x = 0.0
        self.goals: list[float] = []

    async def on_navigate_to_pose(
        self, goal: nav2.NavigateToPose_Goal, feedback: Callable[[nav2.NavigateToPose_Feedback], None]
    ) -> nav2.NavigateToPose_Result:
        target = goal.pose.pose.position.x
        self.goals.append(target)
        if target < 0.0:
            return nav2.NavigateToPose_Result(208, "no path leads there")
        if target > 100.0:
            return nav2.NavigateToPose_Result(106, REFUSED)
        while self.x != target:
            away = target - self.x
            self.x += math.copysign(min(abs(away), 0.1 * SPEED), away)
            pose = TransformStamped.of(self.now_ns, "map", "base_link", SE2(self.x, 0.0, 0.0))
            self.publish("tf", TFMessage((pose,)))
            here = PoseStamped(Header.of(self.now_ns, "map"), Pose.of(SE2(self.x, 0.0, 0.0)))
            feedback(nav2.NavigateToPose_Feedback(here, distance_remaining=abs(target - self.x)))
            await self.sleep(0.1)
        return nav2.NavigateToPose_Result()


def runner(**params: Any) -> NodeRunner:
    kinds = {
        "driver": "tests.nodes.test_waypoint_follower:LineNavigator",
        "follower": "chefbot.nodes.navigation.waypoint_follower:WaypointFollowerNode",
        "sequence": "chefbot.nodes.navigation.pose_sequence:PoseSequenceNode",
    }
    return NodeRunner(kinds, {}, {"follower": params})


def pose(x: float, frame: str = "map") -> PoseStamped:
    return PoseStamped(Header.of(0, frame), Pose.of(SE2(x, 0.0, 0.0)))


def send(nodes: NodeRunner, name: str, action: Any, goal: Any, seconds: float) -> Any:
    """Return the outcome of a goal, None if it has not ended."""
    goal_id = UUID(np.arange(16, dtype=np.uint8))
    count = len(nodes.messages(f"{name}/_action/get_result"))
    nodes.loop.publish(f"{name}/_action/send_goal", action.send_goal(goal_id, goal), "client")
    nodes.run(seconds)
    outcomes = nodes.messages(f"{name}/_action/get_result")[count:]
    return outcomes[-1] if outcomes else None


def follow(nodes: NodeRunner, xs: list[float], first: int = 0, loops: int = 0) -> Any:
    goal = nav2.FollowWaypoints_Goal(loops, first, tuple(pose(x) for x in xs))
    return send(nodes, "follow_waypoints", nav2.FollowWaypoints, goal, 60.0)


def goals(nodes: NodeRunner) -> list[float]:
    driver: Any = nodes.system.nodes["driver"]
    return driver.goals


def test_all_waypoints_are_visited_in_all_rounds() -> None:
    nodes = runner()
    outcome = follow(nodes, [1.0, 2.0, 0.5], first=1, loops=1)
    assert outcome.status == STATUS_SUCCEEDED and outcome.result.missed_waypoints == ()
    assert goals(nodes) == [2.0, 0.5, 1.0, 2.0, 0.5]
    feedback = [one.feedback.current_waypoint for one in nodes.messages("follow_waypoints/_action/feedback")]
    assert feedback == [1, 2, 0, 1, 2]
    phases = [one.data for one in nodes.messages("phase")]
    assert phases[0] == "Driving to table 1 (2 of 3, round 1 of 2)." and phases[-2].startswith("All")
    assert phases[-1] == "", "the outcome is shown for a limited time"


def test_a_missed_waypoint_is_reported_and_the_next_one_follows() -> None:
    outcome = follow(runner(), [1.0, -1.0, 2.0])
    (missed,) = outcome.result.missed_waypoints
    assert outcome.status == STATUS_SUCCEEDED and outcome.result.error_code == 0
    assert (missed.waypoint_index, missed.waypoint_status, missed.error_code) == (1, nav2.FAILED, 208)
    assert missed.error_msg == "no path leads there"


def test_stop_on_failure_ends_at_a_missed_waypoint() -> None:
    nodes = runner(stop_on_failure=True)
    outcome = follow(nodes, [1.0, -1.0, 2.0])
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, STOP_ON_MISSED_WAYPOINT)
    assert goals(nodes) == [1.0, -1.0]


def test_the_robot_waits_at_each_waypoint() -> None:
    nodes = runner(waypoint_pause_duration=10.0)
    follow(nodes, [0.5, 1.0, 1.5])
    results = [one.stamp.ns for one in nodes.messages("navigate_to_pose/_action/get_result")]
    assert np.all(np.diff(results) >= 10e9)


@pytest.mark.parametrize(
    ("xs", "first", "loops", "code"),
    [
        ([], 0, 0, NO_VALID_WAYPOINTS),
        ([1.0], 7, 0, NO_VALID_WAYPOINTS),
        ([-1.0, -2.0], 0, 4_000_000_000, UNKNOWN),
        ([200.0], 0, 4_000_000_000, UNKNOWN),
    ],
    ids=["none", "index too large", "none reachable", "emergency stop"],
)
def test_waypoints_without_a_path_abort_with_a_reason(
    xs: list[float], first: int, loops: int, code: int
) -> None:
    nodes = runner()
    outcome = follow(nodes, xs, first, loops)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, code)
    assert outcome.result.error_msg
    assert follow(nodes, [1.0]).status == STATUS_SUCCEEDED  # ready for the next goal


def test_another_goal_of_the_navigator_ends_the_run() -> None:
    nodes = runner()
    goal = nav2.FollowWaypoints_Goal(0, 0, (pose(30.0),))
    assert send(nodes, "follow_waypoints", nav2.FollowWaypoints, goal, 2.0) is None
    send(nodes, "navigate_to_pose", nav2.NavigateToPose, nav2.NavigateToPose_Goal(pose(0.5)), 5.0)
    assert nodes.messages("follow_waypoints/_action/get_result")[-1].status == STATUS_CANCELED


def test_a_patrol_over_places_goes_on_until_it_is_cancelled() -> None:
    nodes = runner()
    nodes.loop.publish("patrol", PatrolOrder(("kitchen", "2"), 0), "page", from_device=True)
    nodes.run(60.0)
    assert goals(nodes)[:4] == [ROOM["kitchen"], ROOM["table_2"]] * 2 and len(goals(nodes)) > 8
    assert nodes.messages("phase")[-1].data.startswith("Driving to")
    nodes.loop.publish("cancel", Empty(), "page", from_device=True)
    nodes.run(1.0)
    assert nodes.messages("follow_waypoints/_action/get_result")[-1].status == STATUS_CANCELED
    assert nodes.messages("phase")[-1].data == "The patrol has ended."


@pytest.mark.parametrize("places", [(), ("kitchn",)])
def test_a_patrol_to_unknown_places_is_refused_with_a_reason(places: tuple[str, ...]) -> None:
    nodes = runner()
    nodes.loop.publish("patrol", PatrolOrder(places, 1), "page", from_device=True)
    nodes.run(1.0)
    assert nodes.messages("phase")[-1].data.startswith("No patrol: ") and not goals(nodes)


def through(nodes: NodeRunner, poses: list[PoseStamped]) -> Any:
    goal = nav2.NavigateThroughPoses_Goal(Goals(Header.of(0, "map"), tuple(poses)))
    return send(nodes, "navigate_through_poses", nav2.NavigateThroughPoses, goal, 30.0)


def test_poses_are_driven_through_without_a_stop() -> None:
    nodes = runner()
    outcome = through(nodes, [pose(1.0), pose(2.0), pose(3.0)])
    assert outcome.status == STATUS_SUCCEEDED
    assert [one.waypoint_status for one in outcome.result.waypoint_statuses] == [nav2.COMPLETED] * 3
    feedback = [one.feedback for one in nodes.messages("navigate_through_poses/_action/feedback")]
    remaining = [one.number_of_poses_remaining for one in feedback]
    assert sorted(set(remaining), reverse=True) == [3, 2, 1] and remaining == sorted(remaining, reverse=True)
    assert feedback[0].distance_remaining == pytest.approx(3.0, abs=0.1)
    moves = [m.transforms[0].transform.translation.x for m in nodes.messages("tf")]
    assert moves == sorted(moves)  # straight on


@pytest.mark.parametrize(
    ("poses", "code"),
    [([], 9100), ([pose(1.0, "cloud")], 202), ([pose(math.nan)], 204), ([pose(-1.0)], 208)],
    ids=["none", "unknown frame", "not a number", "no path"],
)
def test_poses_without_a_path_abort_with_a_reason(poses: list[PoseStamped], code: int) -> None:
    nodes = runner()
    outcome = through(nodes, poses)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, code)
    assert outcome.result.error_msg
    assert through(nodes, [pose(1.0)]).status == STATUS_SUCCEEDED
