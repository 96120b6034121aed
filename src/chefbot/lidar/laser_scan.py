"""Revolutions of samples as laser scans."""

from __future__ import annotations

import math

import numpy as np

from chefbot.lidar.own_body import OwnBody
from chefbot.lidar.revolutions import Samples
from chefbot.maths.beams import beams_of
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.sensors import Lidar


def scan_of(revolution: Samples, lidar: Lidar, own_body: OwnBody, frame: str) -> LaserScan:
    """Return a revolution as a scan with the beams of the robot file, counter-clockwise.

    The stamp is the time of the first beam; as the lidar rotates clockwise, the first beam is the last that it
    measured, and the time increment is negative. A beam has the shortest range of its samples, inf if all saw
    nothing, and NaN if there is none near it or it ends within the robot.
    """
    first, step = lidar.angle_min, lidar.angle_increment
    measured = np.where(
        revolution.ranges < lidar.range_min, math.nan, revolution.ranges
    )  # too near to be measured
    measured = np.where(measured > lidar.range_max, math.inf, measured)
    ranges = own_body.without(
        beams_of(revolution.bearings, measured, first, step, lidar.beams), lidar.range_min
    )
    end_ns, period = _line_through(revolution)
    increment = -period * step / (2.0 * math.pi)
    first_ns = round(end_ns + increment * 1e9 * (first + math.pi) / step)
    limits = lidar.range_min, lidar.range_max
    last = lidar.angle_max
    return LaserScan(Header.of(first_ns, frame), first, last, step, increment, period, *limits, ranges)


def _line_through(revolution: Samples) -> tuple[float, float]:
    """Return the time at bearing -pi, ns, and the period of a revolution, s, by a line through the samples' times."""
    times = (revolution.times_ns - revolution.times_ns[0]).astype(np.float64)
    slope, at_zero = np.polyfit(revolution.bearings, times, 1)
    return float(revolution.times_ns[0] + at_zero - math.pi * slope), -2.0 * math.pi * float(slope) / 1e9
