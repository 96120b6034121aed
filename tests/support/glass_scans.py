"""Scans of a robot that drives along y past walls of glass, opaque ones and posts, in a room of opaque walls."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header

Floats = NDArray[np.float64]
ANGLES = np.linspace(-math.pi, math.pi, 360, endpoint=False)
PERIOD, FAR = 0.15, 5.0
"""Time between two scans, s, and distance of the walls of the room from the line of the drive, m."""
SEEN = math.radians(5.0)
"""Angle of incidence up to which glass returns a beam."""


def wall(pose: SE2, x: float, *, glass: bool, start: float = -math.inf, end: float = math.inf) -> Floats:
    """Return the ranges (360,) to a wall at `x` in the world, from y = start to y = end."""
    bearings = ANGLES + pose.yaw
    with np.errstate(divide="ignore"):
        ranges = (x - pose.x) / np.cos(bearings)
    y = pose.y + ranges * np.sin(bearings)
    hit = (ranges > 0.0) & (y >= start) & (y <= end)
    if glass:
        hit &= np.abs(np.cos(bearings)) >= math.cos(SEEN)
    return np.where(hit, ranges, np.inf)


def post(pose: SE2, x: float, y: float, radius: float) -> Floats:
    """Return the ranges (360,) to a round post."""
    away = SE2(pose.x, pose.y, pose.yaw).inverse().apply(np.array([[x, y]]))[0]
    middle = away[0] * np.cos(ANGLES) + away[1] * np.sin(ANGLES)
    inside = radius**2 - (away @ away - middle**2)
    return np.where((inside > 0.0) & (middle > 0.0), middle - np.sqrt(np.maximum(inside, 0.0)), np.inf)


def drive(
    speed: float, distance: float = 1.0, yaw: float = math.pi / 2.0, period: float = PERIOD
) -> Iterator[SE2]:
    """Yield the poses at each scan of a drive along y."""
    for step in range(round(distance / (speed * period))):
        yield SE2(0.0, speed * period * step, yaw)


def scan_of(pose: SE2, ranges: Floats, step: int) -> LaserScan:
    """Return a scan in a room with walls at x = -FAR and FAR."""
    room = np.minimum(wall(pose, FAR, glass=False), wall(pose, -FAR, glass=False))
    return LaserScan(
        header=Header(Time.of(round(step * PERIOD * 1e9)), "lidar"),
        angle_min=-math.pi,
        angle_max=math.pi,
        angle_increment=math.tau / len(ANGLES),
        range_min=0.1,
        range_max=12.0,
        ranges=np.minimum(ranges, room).astype(np.float32),
    )
