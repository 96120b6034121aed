"""A camera that shows nothing: the robot does not drive forward, but may turn and back up."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import Robot, ordered, speeds

from chefbot.behavior.motion_errors import DRIVE
from chefbot.control.path_follower import FollowPathError
from chefbot.maths.se2 import SE2
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, Twist
from chefbot.msgs.nav2_msgs import BackUp_Goal, DriveOnHeading_Goal, FollowPath_Goal
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header


@pytest.fixture
def robot() -> Robot:
    made = Robot()
    sensors: Any = made.system.nodes["sensors"]
    sensors.blind = True
    made.run(0.3)
    return made


def straight_on() -> FollowPath_Goal:
    poses = tuple(PoseStamped(Header.of(0, "odom"), Pose.of(SE2(0.1 * i, 0.0, 0.0))) for i in range(21))
    return FollowPath_Goal(Path(Header.of(0, "odom"), poses))


def test_a_blind_camera_aborts_the_path_and_is_named(robot: Robot) -> None:
    ordered(robot, "follow_path", straight_on(), 5.0)
    (outcome,) = robot.outcomes("follow_path")
    assert outcome.result.error_code == FollowPathError.NO_VALID_CONTROL
    assert "depth camera" in outcome.result.error_msg
    assert not any(speeds(robot))


def test_a_blind_camera_blocks_forward_but_not_backward_motion(robot: Robot) -> None:
    ordered(robot, "drive_on_heading", DriveOnHeading_Goal(Point(0.3), 0.1))
    assert robot.outcomes("drive_on_heading")[0].result.error_code == DRIVE.collision
    assert not any(speeds(robot))
    ordered(robot, "backup", BackUp_Goal(Point(0.3), 0.1))
    assert min(speeds(robot)) < 0.0


def test_a_blind_robot_may_turn(robot: Robot) -> None:
    robot.order("spin")
    robot.run(1.0)
    assert any(one.message.angular.z for one in robot.said if isinstance(one.message, Twist))


@pytest.mark.parametrize(("wall", "level"), [(0.6, OK), (1.5, ERROR)])
def test_a_wall_seen_earlier_explains_a_blind_camera(wall: float, level: int) -> None:
    """The marks that it left say why the picture is empty; marks far off do not."""
    robot = Robot()
    sensors: Any = robot.system.nodes["sensors"]
    sensors.wall = wall
    robot.run(1.0)
    sensors.blind = True
    robot.run(2.5)
    arrays = [one.message for one in robot.said if isinstance(one.message, DiagnosticArray)]
    told = [status for array in arrays for status in array.status if status.name == "obstacle sensors"]
    assert told[-1].level == level, told[-1].message
