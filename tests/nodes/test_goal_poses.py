"""Goals as they come: not a number, in other frames, outside the map, occupied; and the next goal after each."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.causes.statuses import CANCELLED, ENDED_BY_STOP, StatusReports
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_SUCCEEDED
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, Quaternion, TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.nodes.navigation.goal_pose import GoalError, goal_in_map
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams, Out, topic
from chefbot.runtime.transform_buffer import TransformBuffer

GOAL_OUTSIDE_MAP, TF_ERROR = 204, 202


class ObedientController(Node):
    """Is at the end of each path at once, and serves the recovery behaviors that way too."""

    params: NoParams
    tf_out: Out[TFMessage] = topic("tf")
    follow_path = action_server(nav2.FollowPath)

    def start(self) -> None:
        self.ends: list[SE2] = []

    async def on_follow_path(self, goal: nav2.FollowPath_Goal, _: Any) -> nav2.FollowPath_Result:
        await self.sleep(0.2)
        self.ends.append(goal.path.poses[-1].pose.se2)
        self.tf_out.publish(
            TFMessage((TransformStamped.of(self.now_ns, "odom", "base_link", self.ends[-1]),))
        )
        return nav2.FollowPath_Result()


def map_message(occupied: tuple[float, float] | None) -> OccupancyGrid:
    """Return a map of 4 m by 4 m with an obstacle of 20 cm."""
    cells = np.zeros((80, 80), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    if occupied is not None:
        column, row = (math.floor((value + 2.0) / 0.05) for value in occupied)
        cells[row - 2 : row + 2, column - 2 : column + 2] = 100
    return OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, -2.0, -2.0))


def room(*, occupied: tuple[float, float] | None = None, localized: bool = True) -> NodeRunner:
    """Return planner and navigator on a map around the robot; not `localized`: before its first pose on it."""
    kinds = {
        "planner": "chefbot.nodes.planner:PlannerNode",
        "navigator": "chefbot.nodes.navigator:NavigatorNode",
        "controller": "tests.nodes.test_goal_poses:ObedientController",
    }
    nodes = NodeRunner(kinds, {})
    nodes.loop.publish("map", map_message(occupied), "test")
    place(nodes, "odom", "base_link", SE2(-0.5, -0.5, math.pi / 2))
    if localized:
        place(nodes, "map", "odom", SE2(0.0, 0.0, 0.0))
    nodes.run(0.5)
    return nodes


def place(nodes: NodeRunner, parent: str, child: str, pose: SE2) -> None:
    message = TFMessage((TransformStamped.of(0, parent, child, pose),))
    nodes.loop.publish("tf_static" if parent == "map" else "tf", message, "test")


def send_goal(nodes: NodeRunner, goal: PoseStamped) -> None:
    goal_id = UUID(np.arange(16, dtype=np.uint8))
    message = nav2.NavigateToPose.send_goal(goal_id, nav2.NavigateToPose_Goal(goal))
    nodes.loop.publish("navigate_to_pose/_action/send_goal", message, "client")


def navigate(nodes: NodeRunner, goal: PoseStamped) -> Any:
    """Return the outcome of a goal."""
    send_goal(nodes, goal)
    nodes.run(10.0)
    return nodes.messages("navigate_to_pose/_action/get_result")[-1]


def at(x: float, y: float, frame: str = "map") -> PoseStamped:
    return PoseStamped(Header.of(0, frame), Pose.of(SE2(x, y, 0.0)))


@pytest.mark.parametrize(
    ("goal", "code", "reason"),
    [
        (at(math.nan, 0.0), GOAL_OUTSIDE_MAP, "The goal is not a pose on the map"),
        (at(math.inf, 0.0), GOAL_OUTSIDE_MAP, "The goal is not a pose on the map"),
        (at(1e300, 0.0), GOAL_OUTSIDE_MAP, "The goal is not a pose on the map"),
        (at(50.0, 0.0), GOAL_OUTSIDE_MAP, "outside the map"),
        (at(1.0, 0.0, "kitchen_table"), TF_ERROR, "in the frame 'kitchen_table'"),
        (
            PoseStamped(Header.of(0, "map"), Pose(Point(), Quaternion(0.0, 0.0, 0.0, 0.0))),
            GOAL_OUTSIDE_MAP,
            "The goal is not a pose on the map",
        ),
    ],
    ids=["nan", "infinite", "huge", "outside", "frame", "rotation"],
)
def test_an_invalid_goal_is_aborted_with_a_reason(goal: PoseStamped, code: int, reason: str) -> None:
    nodes = room()
    outcome = navigate(nodes, goal)
    assert (outcome.status, outcome.result.error_code) == (STATUS_ABORTED, code)
    assert reason in outcome.result.error_msg
    controller: Any = nodes.system.nodes["controller"]
    assert not controller.ends  # it stands
    statuses = nodes.messages("navigation_status")
    assert statuses[-1].state == "idle" and reason in statuses[-1].reason
    assert "driving" in [status.state for status in statuses]  # so that giving up is a cause
    assert navigate(nodes, at(1.0, 0.0)).status == STATUS_SUCCEEDED


def test_a_goal_in_the_robots_frame_is_transformed_once() -> None:
    nodes = room()
    assert navigate(nodes, at(1.0, 0.0, "base_link")).status == STATUS_SUCCEEDED
    controller: Any = nodes.system.nodes["controller"]
    end = controller.ends[-1]
    assert (end.x, end.y, end.yaw) == pytest.approx((-0.5, 0.5, math.pi / 2))
    (shown,) = nodes.messages("navigation_goal")
    assert shown.header.frame_id == "map"


def test_a_goal_before_the_first_pose_waits_for_localization() -> None:
    nodes = room(localized=False)
    send_goal(nodes, at(1.0, 0.0))
    nodes.run(3.0)
    place(nodes, "map", "odom", SE2(0.0, 0.0, 0.0))
    nodes.run(2.0)
    assert nodes.messages("navigate_to_pose/_action/get_result")[-1].status == STATUS_SUCCEEDED
    assert all(one.recoveries == 0 for one in nodes.messages("navigation_status"))


def test_an_occupied_goal_ends_beside_it_and_this_is_reported() -> None:
    nodes = room(occupied=(1.0, 0.0))
    outcome = navigate(nodes, at(1.0, 0.0))
    assert (outcome.status, outcome.result.error_code) == (STATUS_SUCCEEDED, 0)
    assert outcome.result.error_msg.startswith(
        "The goal is occupied: the robot drives to a free pose with sight"
    )
    controller: Any = nodes.system.nodes["controller"]
    assert 0.2 < controller.ends[-1].distance(SE2(1.0, 0.0, 0.0)) < 0.5
    driving = [one.reason for one in nodes.messages("navigation_status") if one.state == "driving"]
    assert driving[-1] == outcome.result.error_msg
    causes = [one for one in nodes.messages("cause_reports") if one.check == "goal occupied"]
    assert len(causes) == 2 and causes[0].sensor == "map" and causes[0].located
    assert navigate(nodes, at(0.0, 1.0)).result.error_msg == ""


def test_the_robot_goes_on_to_a_goal_that_becomes_free() -> None:
    """Whoever stands there has some seconds to step aside after the robot has come near, if only for a moment."""
    nodes = room(occupied=(1.0, 0.0))
    send_goal(nodes, at(1.0, 0.0))
    nodes.run(2.0)
    assert not nodes.messages("navigate_to_pose/_action/get_result")
    for occupied in (None, (1.0, 0.0)):
        nodes.loop.publish("map", map_message(occupied), "test")
        nodes.run(2.0)
    outcome = nodes.messages("navigate_to_pose/_action/get_result")[-1]
    assert outcome.status == STATUS_SUCCEEDED and outcome.result.error_msg == ""
    controller: Any = nodes.system.nodes["controller"]
    assert controller.ends[-1].distance(SE2(1.0, 0.0, 0.0)) < 0.01


def test_a_goal_in_a_wall_far_from_any_floor_is_given_up() -> None:
    nodes = room()
    outcome = navigate(nodes, at(1.99, 1.99))
    assert outcome.result.error_code == 0 and "occupied" in outcome.result.error_msg


def test_a_goal_without_a_frame_is_on_the_map() -> None:
    goal = PoseStamped(Header(), Pose.of(SE2(1.0, 2.0, 0.0)))
    assert goal_in_map(goal, TransformBuffer()) is goal
    with pytest.raises(GoalError, match="in the frame 'odom'"):
        goal_in_map(at(1.0, 0.0, "odom"), TransformBuffer())


@pytest.mark.parametrize(
    ("topic", "message", "reason"),
    [("emergency_stop", Bool(True), ENDED_BY_STOP), ("cancel", Empty(), CANCELLED)],
)
def test_the_status_names_what_ended_a_goal(topic: str, message: Any, reason: str) -> None:
    nodes = room()
    send_goal(nodes, PoseStamped(Header.of(0, "map"), Pose.of(SE2(1.0, 1.0, 0.0))))
    nodes.run(0.1)
    assert nodes.messages("navigation_status")[-1].state == "driving"
    nodes.loop.publish(topic, message, "client", from_device=True)
    nodes.run(1.0)
    status = nodes.messages("navigation_status")[-1]
    assert (status.state, status.reason) == ("idle", reason)
    reported = StatusReports()
    causes = [
        one.check for sent in nodes.messages("navigation_status") for one in reported.navigation(sent, 0)
    ]
    assert causes == ([] if topic == "emergency_stop" else ["cancelled goal"] * 2), "its begin and its end"
