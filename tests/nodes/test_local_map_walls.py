"""The controller keeps off walls of the map that no sensor sees, as of glass, if a lidar sees the others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.nodes.clear_sensors import WALL
from tests.support.nodes import StationaryRobot, commanded_speeds, send_goal_and_run

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import FollowPath_Goal
from chefbot.msgs.nav_msgs import OccupancyGrid, Path
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.local_map_walls import REACH
from chefbot.robot.load import load_robot

PATH = FollowPath_Goal(
    Path(
        Header.of(0, "odom"),
        tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.05 * i, 0.0, 0.0))) for i in range(31)),
    )
)


def map_with_wall(x: float, gap: float = 0.0) -> OccupancyGrid:
    """Return a map 8 m x 8 m with a wall across at x, and a gap in it straight ahead, m."""
    cells = np.zeros((160, 160), np.int8)
    y = (np.arange(160) + 0.5) * 0.05 - 4.0
    cells[np.abs(y) >= 0.5 * gap, round((x + 4.0) / 0.05)] = 100
    return OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, -4.0, -4.0))


def drive_at(
    message: OccupancyGrid | None, robot: str = "chefbot_lidar", measured: float = WALL
) -> StationaryRobot:
    """Return a robot after 3 s on a path straight ahead; measured: range of a wall across that a lidar sees, m."""
    runner = StationaryRobot(load_robot(robot))
    sensors: Any = runner.system.nodes["sensors"]
    angles = np.radians(np.arange(-180.0, 180.0))
    ahead = np.abs(angles) < 1.3
    sensors.ranges = np.where(ahead, np.minimum(measured / np.cos(angles), WALL), WALL).astype(np.float32)
    if message is not None:
        runner.loop.publish("map", message, "map_server")
    runner.run(1.0)
    send_goal_and_run(runner, "follow_path", PATH, 3.0)
    return runner


def speed(robot: StationaryRobot) -> float:
    return commanded_speeds(robot)[-1]


def is_lethal(robot: StationaryRobot, x: float) -> bool:
    """Return whether the local costmap has an obstacle straight ahead at x, m."""
    grid = robot.messages("local_costmap/costmap")[-1].grid
    return bool(grid.at(x, 0.0) == 100)


def test_a_wall_of_the_map_that_no_sensor_sees_is_an_obstacle() -> None:
    without, before = drive_at(None), drive_at(map_with_wall(0.4))
    assert is_lethal(before, 0.41)
    assert not is_lethal(without, 0.41)
    assert speed(before) < 0.7 * speed(without)


def test_a_wall_that_the_map_lost_is_none() -> None:
    robot = drive_at(map_with_wall(0.4))
    robot.loop.publish("map", map_with_wall(3.0), "map_server")
    robot.run(2.0)
    assert not is_lethal(robot, 0.41)


def test_through_a_wide_gap_of_such_a_wall_it_drives() -> None:
    assert speed(drive_at(map_with_wall(0.4, gap=1.2))) > 0.1


def test_a_wall_out_of_reach_is_left_to_the_planner() -> None:
    robot = drive_at(map_with_wall(REACH + 0.2))
    assert not is_lethal(robot, REACH + 0.21)


@pytest.mark.parametrize("x", [-0.1, 0.0])
def test_out_of_a_wall_of_the_map_it_drives(x: float) -> None:
    assert speed(drive_at(map_with_wall(x))) > 0.1


def test_a_camera_alone_trusts_what_it_saw() -> None:
    assert not is_lethal(drive_at(map_with_wall(0.4), "chefbot"), 0.41)


def test_where_a_sensor_sees_the_wall_the_map_does_not_count() -> None:
    """The pose is 0.1 m off: the wall is measured farther away than the map shows it."""
    robot = drive_at(map_with_wall(0.52), measured=0.62)
    assert speed(robot) == speed(drive_at(None, measured=0.62))
