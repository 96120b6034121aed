"""Tests that a robot with a blind depth camera does not drive forward, but may spin and back up."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import StationaryRobot, commanded_speeds, send_goal_and_run

from chefbot.behavior.motion_errors import DRIVE
from chefbot.control.path_follower import FollowPathError
from chefbot.maths.se2 import SE2
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, Twist
from chefbot.msgs.nav2_msgs import BackUp_Goal, DriveOnHeading_Goal, FollowPath_Goal
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header


@pytest.fixture
def robot() -> StationaryRobot:
    running = StationaryRobot()
    sensors: Any = running.system.nodes["sensors"]
    sensors.blind = True
    running.run(0.3)
    return running


def straight_path() -> FollowPath_Goal:
    poses = tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.1 * i, 0.0, 0.0))) for i in range(21))
    return FollowPath_Goal(Path(Header.of(0, "odom"), poses))


def test_a_blind_camera_aborts_the_path_and_is_named(robot: StationaryRobot) -> None:
    send_goal_and_run(robot, "follow_path", straight_path(), 5.0)
    (outcome,) = robot.results("follow_path")
    assert outcome.result.error_code == FollowPathError.NO_VALID_CONTROL
    assert "depth camera" in outcome.result.error_msg
    assert not any(commanded_speeds(robot))


def test_a_blind_camera_blocks_forward_but_not_backward_motion(robot: StationaryRobot) -> None:
    send_goal_and_run(robot, "drive_on_heading", DriveOnHeading_Goal(Point(0.3), 0.1))
    assert robot.results("drive_on_heading")[0].result.error_code == DRIVE.collision
    assert not any(commanded_speeds(robot))
    send_goal_and_run(robot, "backup", BackUp_Goal(Point(0.3), 0.1))
    assert min(commanded_speeds(robot)) < 0.0


def test_a_robot_with_a_blind_camera_may_spin(robot: StationaryRobot) -> None:
    robot.send_goal("spin")
    robot.run(1.0)
    assert any(item.message.angular.z for item in robot.published if isinstance(item.message, Twist))


@pytest.mark.parametrize(("wall", "level"), [(0.6, OK), (1.5, ERROR)])
def test_a_wall_seen_earlier_explains_a_blind_camera(wall: float, level: int) -> None:
    """Marks of a near obstacle explain that the camera measures nothing; marks far away do not."""
    robot = StationaryRobot()
    sensors: Any = robot.system.nodes["sensors"]
    sensors.wall = wall
    robot.run(1.0)
    sensors.blind = True
    robot.run(2.5)
    arrays = [item.message for item in robot.published if isinstance(item.message, DiagnosticArray)]
    statuses = [status for array in arrays for status in array.status if status.name == "obstacle sensors"]
    assert statuses[-1].level == level, statuses[-1].message
