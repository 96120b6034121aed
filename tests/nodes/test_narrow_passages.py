"""The controller creeps through a passage that is little wider than the robot, if a lidar sees both sides of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.nodes.clear_sensors import WALL
from tests.support.nodes import StationaryRobot, commanded_speeds, send_goal_and_run

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import FollowPath_Goal
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.navigation.narrow_passages import CREEPS
from chefbot.robot.load import load_robot
from chefbot.safety.monitor_polygons import CREEP_SPEED

PATH = FollowPath_Goal(
    Path(
        Header.of(0, "odom"),
        tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.05 * i, 0.0, 0.0))) for i in range(31)),
    )
)
AT = 0.4
"""Distance of the wall with the gap, m."""


def gap(width: float) -> np.ndarray:
    """Return the ranges that a lidar measures before a wall across, with a gap straight ahead."""
    angles = np.radians(np.arange(-180.0, 180.0))
    across = AT * np.tan(angles)
    on_wall = (np.abs(angles) < 1.3) & (np.abs(across) > 0.5 * width)
    return np.where(on_wall, AT / np.cos(angles), WALL).astype(np.float32)


def drive_at_gap(width: float, robot: str = "chefbot_lidar") -> StationaryRobot:
    """Return a standing robot that has been following a path through a gap for 4 s."""
    runner = StationaryRobot(load_robot(robot))
    sensors: Any = runner.system.nodes["sensors"]
    sensors.ranges = gap(width)
    runner.run(0.5)
    send_goal_and_run(runner, "follow_path", PATH, 4.0)
    return runner


def creeps(robot: StationaryRobot) -> bool:
    return CREEPS in [report.sentence for report in robot.messages("cause_reports")]


def test_through_a_gap_of_the_body_and_a_little_it_creeps() -> None:
    robot = drive_at_gap(0.40)
    assert creeps(robot)
    assert 0.0 < commanded_speeds(robot)[-1] <= CREEP_SPEED


@pytest.mark.parametrize(
    ("width", "robot"), [(0.24, "chefbot_lidar"), (0.40, "chefbot"), (0.70, "chefbot_lidar")]
)
def test_elsewhere_it_does_not_creep(width: float, robot: str) -> None:
    assert not creeps(drive_at_gap(width, robot))


def test_in_a_gap_wide_enough_it_drives_as_usual() -> None:
    assert max(commanded_speeds(drive_at_gap(0.70))) > 2.0 * CREEP_SPEED
