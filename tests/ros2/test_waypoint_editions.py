"""Waypoints over the wire: goals and results of Jazzy's clients, whose fields have other types."""

from __future__ import annotations

import threading

import pytest
from tests.support.waiting import PATIENCE

from chefbot.maths.se2 import SE2
from chefbot.msgs.action_msgs import STATUS_ABORTED
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.idl.editions import older_editions
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav2_msgs import (
    FAILED,
    FollowWaypoints,
    FollowWaypoints_Feedback,
    FollowWaypoints_Result,
    NavigateThroughPoses,
    NavigateThroughPoses_Feedback,
    NavigateThroughPoses_Result,
    WaypointStatus,
)
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.ros2.rmw.action_client import ActionClient
from chefbot.ros2.rmw.action_server import ActionServer
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

POSES = tuple(PoseStamped(Header.of(0, "map"), Pose.of(SE2(float(x), 0.0, 0.0))) for x in range(3))
MISSED = (WaypointStatus(FAILED, 2, POSES[2], 208, "no path"),)
CASES = {
    "follow_waypoints": (
        FollowWaypoints,
        FollowWaypoints_Feedback(2),
        FollowWaypoints_Result(MISSED, 603, "one was missed"),
    ),
    "navigate_through_poses": (
        NavigateThroughPoses,
        NavigateThroughPoses_Feedback(number_of_poses_remaining=3, waypoint_statuses=MISSED),
        NavigateThroughPoses_Result(208, "no path", MISSED),
    ),
}


class WaypointServer:
    """Serves an action: sends one feedback and ends each goal with one result."""

    def __init__(self, node: RmwNode, name: str) -> None:
        action, self._feedback, self._result = CASES[name]
        self.goals: list[Message] = []
        self.server = ActionServer(node, f"/{name}", action, self._accept, lambda _: True)

    def _accept(self, goal_id: UUID, goal: Message) -> bool:
        self.goals.append(goal)
        self.server.execute(goal_id)
        self.server.publish_feedback(goal_id, self._feedback)
        self._end = threading.Timer(0.2, self.server.finish, (goal_id, STATUS_ABORTED, self._result))
        self._end.start()
        return True

    def wait(self) -> None:
        """Wait for the last status, which follows the result."""
        self._end.join()


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("edition", ["kilted", "jazzy"])
def test_a_client_of_each_distribution_is_served(
    wire: RmwContext, port: int, name: str, edition: str
) -> None:
    newest = CASES[name][0]
    action = newest if edition == "kilted" else older_editions(newest.ros_name)[0]
    with (
        RmwNode(wire, "waypoint_follower") as node,
        RmwContext(port=port, router=False) as far,
        RmwNode(far, "client") as client_node,
    ):
        server = WaypointServer(node, name)
        client = ActionClient(client_node, name, action)
        assert far.graph.wait_for(lambda _: client.served, PATIENCE)
        poses = POSES if edition == "jazzy" or name == "follow_waypoints" else newest.goal().poses
        goal = action.goal(**{"poses": poses})
        status, result = client.send_goal_async(goal).result.result(PATIENCE)
        server.wait()
        assert status == STATUS_ABORTED and result.error_code == CASES[name][2].error_code
        assert type(server.goals[0]) is newest.goal
        if name == "follow_waypoints":
            assert [pose.pose.se2 for pose in server.goals[0].poses] == [pose.pose.se2 for pose in POSES]
            (missed,) = result.missed_waypoints
            assert missed.error_code == 208
        elif edition == "jazzy":
            assert len(server.goals[0].poses.goals) == len(POSES)
