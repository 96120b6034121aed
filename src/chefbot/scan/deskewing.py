"""Removal of the skew of scans: a lidar turns while the robot moves, so each beam has a pose of its own.

The beams are moved to where they would have been measured from at the time of the first one, with the sensor's poses
by odometry (laser_geometry of ROS does the same with tf; Zhang and Singh, LOAM, 2014, section V).
"""

from __future__ import annotations

import math

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.maths.beams import beams_of
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan

MAX_SWEEP = 1.0
"""Duration of a sweep beyond which a scan's time increment is taken as an error of its driver, s."""
KNOT_PERIOD = 0.01
"""Time between two poses of the sensor within a sweep, s; between them it moves evenly."""
MIN_SHIFT, MIN_TURN = 0.001, 0.0005
"""Motion during a sweep, m and rad, below which its skew is less than any lidar's noise."""


def sweep_duration(scan: LaserScan) -> float:
    """Return the time from the first beam to the last, s: negative for a lidar that turns clockwise, 0 if unknown."""
    duration = float(scan.time_increment) * max(len(scan.ranges) - 1, 0)
    return duration if abs(duration) <= MAX_SWEEP else 0.0


def knot_times(scan: LaserScan) -> list[int]:
    """Return the times, ns, from that of the first beam to that of the last one, at which poses are needed."""
    duration = sweep_duration(scan)
    count = 1 + math.ceil(abs(duration) / KNOT_PERIOD)
    return [scan.header.stamp.ns + round(1e9 * duration * i / max(count - 1, 1)) for i in range(count)]


def deskewed(scan: LaserScan, poses: list[SE2]) -> LaserScan:
    """Return the scan as if all beams had been measured at its stamp, with the time increment 0.

    poses: of the sensor in one fixed frame at `knot_times`. A direction into which no beam looked then has NaN; a
    robot that stood has the scan as it was.
    """
    first = poses[0]
    moved = np.array([first.between(pose) for pose in poses])
    turn = np.unwrap(moved[:, 2])
    if np.abs(moved[:, :2]).max() < MIN_SHIFT and np.abs(turn).max() < MIN_TURN:
        return msgspec.structs.replace(scan, time_increment=0.0)
    bearings, ranges = _seen_from_first(scan, moved, turn)
    count = len(scan.ranges)
    found = beams_of(bearings, ranges, float(scan.angle_min), float(scan.angle_increment), count)
    return msgspec.structs.replace(scan, time_increment=0.0, ranges=found, intensities=scan.intensities[:0])


def _seen_from_first(
    scan: LaserScan, moved: NDArray[np.float64], turn: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return bearings and ranges (n,) of the beams in the first pose of the sensor."""
    count = len(scan.ranges)
    knots = np.linspace(0.0, max(count - 1, 1), len(moved))
    beams = np.arange(count, dtype=np.float64)
    x, y, yaw = (np.interp(beams, knots, values) for values in (moved[:, 0], moved[:, 1], turn))
    bearings = scan.angles.astype(np.float64) + yaw
    ranges = scan.ranges.astype(np.float64)
    measured = np.isfinite(ranges)
    px = x + np.where(measured, ranges, 0.0) * np.cos(bearings)
    py = y + np.where(measured, ranges, 0.0) * np.sin(bearings)
    # a beam without a return keeps its direction only
    return np.where(measured, np.arctan2(py, px), bearings), np.where(measured, np.hypot(px, py), ranges)
