"""The plane in which a robot scans, and which obstacles of other heights it meets."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.robot.spec import Robot

PLANE_MARGIN, PLANE_TILT = 0.03, 0.0175
"""Margins, m and rad of pitch, by which an obstacle must extend above and below the scan plane."""


def plane_of(robot: Robot) -> float:
    """Return the height (m) above the floor of the robot's scan plane: the lidar's, else the depth camera's.

    NaN, which no obstacle intersects, if there is none: the scan of a tilted sensor is not in a level plane.
    """
    sensor = robot.sensors.lidar or robot.sensors.depth_camera
    return sensor.mount.z if sensor is not None and abs(sensor.mount.pitch) <= PLANE_TILT else math.nan


def through_plane(
    bottom: NDArray[np.float32], top: NDArray[np.float32], ranges: NDArray[np.float64], plane: float
) -> NDArray[np.bool_]:
    """Return which obstacles (n,) of a height interval, m, intersect the scan plane, also while the robot pitches.

    ranges: their distances, m. bottom and top may be empty: heights were not measured, and none is known to
    intersect.
    """
    if len(bottom) != len(ranges) or len(top) != len(ranges):
        return np.zeros(len(ranges), np.bool_)
    margin = PLANE_MARGIN + PLANE_TILT * np.where(np.isfinite(ranges), ranges, 0.0)
    met: NDArray[np.bool_] = (bottom < plane - margin) & (top > plane + margin)
    return met
