"""Plans through passages in which the body just fits: only where the map has no wider path, and with a lidar only."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.costmap.sources import PERMANENT_SOURCES
from chefbot.maths.costs import LETHAL
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav2_msgs import ComputePathToPose, ComputePathToPose_Goal
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.planning.closed_routes import STANDING_TIME
from chefbot.robot.load import load_robot

START, GOAL = SE2(-1.5, 0.0, 0.0), SE2(1.5, 0.0, 0.0)
CLEAR_WIDTH, NARROW_WIDTH, CLOSED_WIDTH = 16, 8, 4
"""Widths of a gap in cells of 5 cm; the robot's body has 30 cm."""


class Room:
    """The planner of a robot in a room of 6 m by 6 m that a wall at x = 0 with gaps divides."""

    def __init__(self, robot: str = "chefbot_lidar", **gaps: int) -> None:
        """gaps: width of the gap at y = 0 and y = 2, `near` and `far`, in cells."""
        self.nodes = NodeRunner({"planner": "chefbot.nodes.planner:PlannerNode"}, {}, robot=load_robot(robot))
        cells = np.zeros((120, 120), np.int8)
        cells[[0, -1], :] = cells[:, [0, -1]] = cells[:, 60] = 100
        for first, name in ((60, "near"), (100, "far")):
            cells[first - gaps.get(name, 0) // 2 : first + gaps.get(name, 0) // 2, 60] = 0
        self.send("map", OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, -3.0, -3.0)))
        for parent, child, pose in (("map", "odom", SE2(0, 0, 0)), ("odom", "base_link", START)):
            self.send("tf_static", TFMessage((TransformStamped.of(0, parent, child, pose),)))
        self.nodes.run(0.5)

    def send(self, topic: str, message: Any) -> None:
        self.nodes.loop.publish(topic, message, "test", from_device=True)
        self.nodes.run(0.05)

    def see(self, x: float, y: float) -> None:
        """See something at a point of the map, from the robot."""
        angles = np.arctan2([y - START.y], x - START.x)
        header = Header.of(self.nodes.loop.now_ns, "base_link")
        ranges = np.hypot([x - START.x], [y - START.y]).astype(np.float32)
        self.send("scan", LaserScan(header, angles[0], angles[0], 0.01, 0.0, 0.1, 0.1, 8.0, ranges))

    def mark(self, source: str, x: float, y: float) -> None:
        """Mark the cell at a point of the map, as its source does."""
        costs = self.nodes.system.nodes["planner"]._costs  # type: ignore[attr-defined]
        costs.source_cells(source)[math.floor((y + 3.0) / 0.05), math.floor((x + 3.0) / 0.05)] = LETHAL
        costs.note_all_changed()

    def plan(self) -> Any:
        """Return the result of a plan from the robot to the other side."""
        goal = PoseStamped(Header.of(0, "map"), Pose.of(GOAL))
        request = ComputePathToPose.send_goal(
            UUID(np.arange(16, dtype=np.uint8)), ComputePathToPose_Goal(goal)
        )
        self.send("compute_path_to_pose/_action/send_goal", request)
        self.nodes.run(1.0)
        return self.nodes.messages("compute_path_to_pose/_action/get_result")[-1].result

    def crosses_at(self, x: float = 0.0) -> float:
        """Return the y at which the path to the other side crosses the wall, or another x, m."""
        path = np.array([pose.pose.se2 for pose in self.plan().path.poses])
        return float(path[np.argmin(np.abs(path[:, 0] - x)), 1])


def test_a_narrow_passage_that_is_the_only_path_is_taken() -> None:
    assert Room(near=NARROW_WIDTH).crosses_at() == pytest.approx(0.0, abs=0.05)


def test_a_wider_path_is_preferred_though_it_is_longer() -> None:
    assert Room(near=NARROW_WIDTH, far=CLEAR_WIDTH).crosses_at() == pytest.approx(2.0, abs=0.3)


def test_what_closes_the_wider_path_may_leave() -> None:
    room = Room(near=NARROW_WIDTH, far=CLEAR_WIDTH)
    room.see(0.0, 2.0)
    assert room.plan().error_code != 0


def test_what_stands_in_the_wider_path_for_long_does_not_leave() -> None:
    """A step below the plane of the lidar is on no map."""
    room = Room(near=NARROW_WIDTH, far=CLEAR_WIDTH)
    room.mark("camera", 0.0, 2.0)
    assert room.plan().error_code != 0
    for _ in range(int(STANDING_TIME)):
        room.plan()
    assert room.crosses_at() == pytest.approx(0.0, abs=0.05)


def test_a_mark_in_the_passage_does_not_count_one_before_it_does() -> None:
    room = Room(near=NARROW_WIDTH)
    room.see(0.0, 0.025)
    assert room.crosses_at() == pytest.approx(0.0, abs=0.05)
    room.see(-0.8, 0.0)
    assert room.crosses_at() == pytest.approx(0.0, abs=0.05)
    assert abs(room.crosses_at(-0.8)) > 0.12


@pytest.mark.parametrize("source", PERMANENT_SOURCES)
def test_glass_or_a_hole_in_the_passage_closes_it(source: str) -> None:
    room = Room(near=NARROW_WIDTH)
    assert room.plan().error_code == 0
    room.mark(source, 0.0, 0.025)
    assert room.plan().error_code != 0


@pytest.mark.parametrize(("robot", "width"), [("chefbot_lidar", CLOSED_WIDTH), ("chefbot", NARROW_WIDTH)])
def test_without_a_lidar_or_room_for_the_body_there_is_no_path(robot: str, width: int) -> None:
    assert Room(robot, near=width).plan().error_code != 0
