"""Simulated drives of camera robots towards drop-offs, by a controller that sees its local costmap only."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import DriveOnHeading, DriveOnHeading_Goal
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_speed
from chefbot.robot.spec import Robot
from chefbot.ros2.rmw.action_client import new_goal_id
from tests.chaos.sensor_fault_drive import SensorFaultDrive

DEPTHS = (0.03, 0.03, 0.04, 0.05, 0.08, 0.17, 0.5)
"""Depths of the drop-offs, m; one of 0.17 m is the first of four steps of a staircase."""
STEP = 0.17
TREAD = 0.28
TILT = math.radians(3.0)
"""Tilt from which a robot is over the edge, rad."""


class Approach(NamedTuple):
    """A drive from `distance` metres before the edge, `yaw` rad from its normal, at a share of the maximum speed."""

    depth: float
    distance: float
    yaw: float
    speed: float
    by_path: bool
    """Whether it follows a path; else it is the behavior drive_on_heading."""


class Arrival(NamedTuple):
    """How an approach ended.

    over: whether a wheel or caster was past the edge. gap: least distance from the robot's outline to the edge, m.
    speed: greatest speed of the drive, m/s.
    """

    over: bool
    gap: float
    speed: float


def draw_approach(seed: int) -> Approach:
    """Return the approach of a seed."""
    rng = np.random.default_rng([seed, 0xD0])
    depth = float(DEPTHS[seed // 2 % len(DEPTHS)])
    distance, yaw = float(rng.uniform(0.9, 2.2)), math.radians(float(rng.uniform(-60.0, 60.0)))
    return Approach(depth, distance, yaw, float(rng.uniform(0.4, 1.5)), bool(rng.integers(2)))


def world_with_edge(approach: Approach, folder: Path) -> Path:
    """Write a world whose floor ends at x = 0, with the robot at its start, and return its path."""
    holes = [f"{{name: hole, x: 3 m, y: 0 m, size: [6 m, 16 m], depth: {approach.depth} m}}"]
    if approach.depth == STEP:
        holes = [
            f"{{name: step_{i}, x: {TREAD * (i + 0.5)} m, y: 0 m, size: [{TREAD} m, 16 m],"
            f" depth: {STEP * (i + 1)} m}}"
            for i in range(4)
        ]
    path = folder / "edge.yaml"
    path.write_text(
        "name: edge\nwalls:\n  - {start: [-6 m, -6 m], end: [-6 m, 6 m]}\n  - {start: [8 m, -6 m], end: [8 m, 6 m]}\n"
        "holes:\n"
        + "".join(f"  - {hole}\n" for hole in holes)
        + f"places:\n  home: {{x: {-approach.distance} m, y: 0 m, yaw: {approach.yaw} rad}}\n"
    )
    return path


def robot_of_speed(name: str, factor: float) -> Robot:
    """Return a robot whose maximum speed is multiplied by a factor."""
    robot = load_robot(name)
    drive = msgspec.structs.replace(robot.drive, max_speed=robot.drive.max_speed * factor)
    return msgspec.structs.replace(robot, drive=drive)


def approach_edge(approach: Approach, folder: Path, seed: int, robot: str = "chefbot") -> Arrival:
    """Drive towards the edge until the robot has stood for 2 s, or is over it."""
    driven = robot_of_speed(robot, approach.speed)
    drive = SensorFaultDrive(driven, None, str(world_with_edge(approach, folder)), seed=seed)
    length = approach.distance / math.cos(approach.yaw) + 1.0
    if approach.by_path:
        drive.follow_straight_path(length)
    else:
        goal = DriveOnHeading_Goal(Point(length), max_speed(driven), Duration.of(40.0))
        message = DriveOnHeading.send_goal(new_goal_id(), goal)
        drive.loop.publish("drive_on_heading/_action/send_goal", message, "test")
    arrival, stood = Arrival(False, math.inf, 0.0), 0.0
    while stood < 2.0 and drive.loop.now_ns < 40e9 and not arrival.over:
        drive.run(0.1)
        truth = drive.simulation.truth()
        stood = stood + 0.1 if abs(truth.v) < 0.01 and abs(truth.w) < 0.02 else 0.0
        over = drive.simulation.tilt > TILT or _foremost(driven, truth.pose) > 0.0
        gap = -truth.pose.x - driven.circumscribed_radius
        arrival = Arrival(over, min(arrival.gap, gap), max(arrival.speed, abs(truth.v)))
    drive.system.stop()
    return arrival


def _foremost(robot: Robot, pose: SE2) -> float:
    """Return the greatest x of the points where wheels and casters touch the floor, m."""
    side, ahead = robot.wheels.separation / 2.0, robot.casters.offset
    points = np.array([[0.0, side], [0.0, -side], [ahead, 0.0], [-ahead, 0.0]])
    return float(pose.apply(points)[:, 0].max())
