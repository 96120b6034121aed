"""Plans where marks of what may leave close every path: of the passages out of sight, not the one just left."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.costmap.recent_poses import RECENT_TIME
from chefbot.maths.costs import LETHAL
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav2_msgs import ComputePathToPose, ComputePathToPose_Goal
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.robot.load import load_robot

LEFT, RIGHT = -6.0, 6.0
"""Middles of the two passages through the wall along y = 0, m."""
GOAL = SE2(LEFT, 2.0, math.pi / 2)


class Hall:
    """The planner of a robot in a hall of 20 m by 6 m that a wall with two occupied passages divides."""

    def __init__(self) -> None:
        self.nodes = NodeRunner(
            {"planner": "chefbot.nodes.planner:PlannerNode"}, {}, robot=load_robot("chefbot_lidar")
        )
        cells = np.zeros((120, 400), np.int8)
        cells[[0, -1], :] = cells[:, [0, -1]] = cells[60, :] = 100
        passages = [
            slice(round((x + 10.0) / 0.05) - 10, round((x + 10.0) / 0.05) + 10) for x in (LEFT, RIGHT)
        ]
        for passage in passages:
            cells[60, passage] = 0
        self.send("map", OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, -10.0, -3.0)))
        origin = TransformStamped.of(0, "map", "odom", SE2(0.0, 0.0, 0.0))
        self.send("tf_static", TFMessage((origin,)))
        costs = self.nodes.system.nodes["planner"]._costs  # type: ignore[attr-defined]
        for passage in passages:
            costs.source_cells("laser")[60, passage] = LETHAL
        costs.note_all_changed()

    def send(self, topic: str, message: object) -> None:
        self.nodes.loop.publish(topic, message, "test", from_device=True)  # type: ignore[arg-type]
        self.nodes.run(0.05)

    def passage_from(self, x: float) -> float:
        """Return where the path to the goal passes the wall for a robot one metre before it, m."""
        robot = TransformStamped.of(self.nodes.loop.now_ns, "odom", "base_link", SE2(x, -1.0, 0.0))
        self.send("tf", TFMessage((robot,)))
        goal = PoseStamped(Header.of(0, "map"), Pose.of(GOAL))
        request = ComputePathToPose.send_goal(
            UUID(np.arange(16, dtype=np.uint8)), ComputePathToPose_Goal(goal)
        )
        self.send("compute_path_to_pose/_action/send_goal", request)
        self.nodes.run(0.5)
        result = self.nodes.messages("compute_path_to_pose/_action/get_result")[-1].result
        path = np.array([pose.pose.se2 for pose in result.path.poses])
        return float(path[np.argmin(np.abs(path[:, 1])), 0])


def test_a_robot_does_not_return_to_what_it_has_seen_closed() -> None:
    hall = Hall()
    assert hall.passage_from(LEFT + 1.0) == pytest.approx(RIGHT, abs=0.5)
    assert hall.passage_from(LEFT + 4.0) == pytest.approx(RIGHT, abs=0.5)


def test_what_was_closed_some_time_ago_may_be_open() -> None:
    hall = Hall()
    assert hall.passage_from(LEFT + 1.0) == pytest.approx(RIGHT, abs=0.5)
    hall.nodes.run(RECENT_TIME)
    assert hall.passage_from(LEFT + 4.0) == pytest.approx(LEFT, abs=0.5)
