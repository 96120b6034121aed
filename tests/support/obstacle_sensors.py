"""Data of obstacle sensors, good and blind, and obstacles that are known from elsewhere."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.robot.section import Mount
from chefbot.robot.spec import Robot
from chefbot.safety.known_obstacles import RememberedPoints
from chefbot.safety.obstacle_sensors import (
    ObstacleSensors,
)

ROBOT = load_robot("chefbot_lidar")
STANDING = SE2(0.0, 0.0, 0.0)
COSTS = Costmap(np.zeros((20, 20), np.uint8), 0.05, -0.5, -0.5)
PERIOD_NS = 100_000_000
BINS, FIRST, STEP = 160, -0.5, 1.0 / 160
"""The directions of the camera's obstacle scans here, from right to left."""
CELL = 0.025
"""Side of a cell of the memory, m."""


def points(known: np.ndarray, resolution: float = CELL) -> RememberedPoints:
    return RememberedPoints(lambda: known, resolution)


NOTHING = points(np.zeros((0, 2)))


def scan(stamp_ns: int, distance: float = 3.0) -> LaserScan:
    ranges = np.full(360, distance, np.float32)
    header = Header.of(stamp_ns, "laser")
    return LaserScan(header, -np.pi, np.pi, np.pi / 180, 0.0, 0.1, 0.16, 8.0, ranges)


def obstacles(stamp_ns: int, distance: float = 2.0, floor: float = 1.9) -> ObstacleScan:
    """Return an obstacle scan with an obstacle at the same distance everywhere, and floor as far as `floor`."""
    ranges, begin, end = (np.full(BINS, value, np.float32) for value in (distance, 0.7, floor))
    return ObstacleScan(Header.of(stamp_ns, "camera_depth_frame"), FIRST, STEP, 8.0, ranges, begin, end)


def never() -> np.ndarray:
    raise AssertionError("the memory need not be searched")


def with_sensors(**sensors: object) -> Robot:
    return msgspec.structs.replace(ROBOT, sensors=msgspec.structs.replace(ROBOT.sensors, **sensors))


def looking(x: float, y: float, yaw: float) -> Robot:
    """Return a robot without a lidar whose camera is mounted there and looks there."""
    camera = ROBOT.sensors.depth_camera
    assert camera is not None
    mount = msgspec.structs.replace(camera.mount, x=x, y=y, yaw=yaw)
    assert isinstance(mount, Mount)
    return with_sensors(lidar=None, depth_camera=msgspec.structs.replace(camera, mount=mount))


def blind_camera(robot: Robot) -> ObstacleSensors:
    """Return sensors whose camera sees nothing at all."""
    sensors = ObstacleSensors(robot)
    sensors.process_obstacles(obstacles(PERIOD_NS, math.inf, 0.0), PERIOD_NS, STANDING)
    return sensors


def run(sensors: ObstacleSensors, count: int, begin_ns: int = 0) -> int:
    """Send good data of both sensors; the ranges change a little, as measured ones do. Return the last time."""
    now_ns = begin_ns
    for k in range(count):
        now_ns = begin_ns + (k + 1) * PERIOD_NS
        sensors.process_scan(scan(now_ns, 3.0 + 0.001 * k), now_ns, STANDING)
        sensors.note_scan_marked(now_ns)
        sensors.process_obstacles(obstacles(now_ns, 2.0 + 0.001 * k), now_ns, STANDING)
        sensors.note_obstacles_marked(now_ns)
    return now_ns


def costs_of(lethal: np.ndarray) -> Costmap:
    """Return a costmap of 4 m with lethal cells at points (n, 2)."""
    cells = np.zeros((80, 80), np.uint8)
    for x, y in lethal.tolist():
        cells[int((y + 2.0) / 0.05), int((x + 2.0) / 0.05)] = LETHAL
    return Costmap(cells, 0.05, -2.0, -2.0)


def half_covered(stamp_ns: int) -> LaserScan:
    """Return a scan of a full turn that has no data on the left, from 0 to a quarter of a turn."""
    covered = scan(stamp_ns, 3.1)
    covered.ranges[(covered.angles > 0.0) & (covered.angles < np.pi / 2)] = -np.inf
    return covered


def lidar_at(x: float, y: float, yaw: float) -> Robot:
    lidar = ROBOT.sensors.lidar
    assert lidar is not None
    mount = msgspec.structs.replace(lidar.mount, x=x, y=y, yaw=yaw)
    return with_sensors(depth_camera=None, lidar=msgspec.structs.replace(lidar, mount=mount))


def arc(sensor: SE2, distance: float, first: float = 0.0, last: float = math.pi / 2) -> np.ndarray:
    """Return points around a sensor at a pose in base_link."""
    bearings = sensor.yaw + np.linspace(first, last, 400)
    return np.column_stack([sensor.x + distance * np.cos(bearings), sensor.y + distance * np.sin(bearings)])
