"""Readings of sensors for the collision monitor, and what it makes of them."""

from __future__ import annotations

import math

import numpy as np

from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot
from chefbot.safety import local_memory as memory
from chefbot.safety.collision_monitor import CollisionMonitor
from chefbot.safety.params import CollisionMonitorParams

SECOND, MS = 1_000_000_000, 1_000_000


def monitor(robot: Robot) -> CollisionMonitor:
    """Return the monitor of a robot with default parameters and 0.04 m before echoes."""
    return CollisionMonitor(robot, CollisionMonitorParams(), 0.04)


def echo(distance: float, time_ms: int = 1000) -> Range:
    """Return an echo of the ultrasonic ranger."""
    return Range(Header.of(time_ms * MS, "ultrasonic_link"), 0, 0.5, 0.02, 4.0, distance)


def scan(
    distance: float, at_s: float = 1.0, range_max: float = 8.0, beams: int = 360, range_min: float = 0.1
) -> LaserScan:
    """Return a scan that shows the same distance all around."""
    step = 2.0 * math.pi / beams
    header, ranges = Header.of(round(at_s * SECOND), "laser"), np.full(beams, distance, np.float32)
    return LaserScan(header, -math.pi, math.pi - step, step, 0.0, 0.1, range_min, range_max, ranges)


def obstacles(
    at: float, clear_from: float, clear_to: float, at_s: float = 1.0, top: float = 0.1
) -> ObstacleScan:
    """Return an obstacle scan of directions up to half a radian to each side; the obstacles stand on the floor."""
    values = [np.full(160, value, np.float32) for value in (at, clear_from, clear_to, 0.0, top)]
    return ObstacleScan(Header.of(round(at_s * SECOND), "camera_depth_frame"), -0.5, 1.0 / 159, 8.0, *values)


def is_seen(one: CollisionMonitor, x: float, kind: int) -> bool:
    """Return whether the ground there, on the x axis of odom, counts as seen."""
    cell, outline = one.polygons.resolution, np.zeros((1, 2))
    pose = np.array([x - cell, 0.0, 0.0])
    time = memory.time_on_seen_ground(one._memory, pose, cell, 0.0, outline, 0.5, 0, 0, kind)
    return time == math.inf
