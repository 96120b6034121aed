"""Turns of samples as laser scans."""

from __future__ import annotations

import math

import numpy as np

from chefbot.lidar.own_body import OwnBody
from chefbot.lidar.turns import Samples
from chefbot.maths.beams import beams_of
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.sensors import Lidar


def scan_of(turn: Samples, lidar: Lidar, own_body: OwnBody, frame: str) -> LaserScan:
    """Return a turn as a scan with the beams of the robot file, counter-clockwise.

    The stamp is the time of the first beam; as the lidar turns clockwise, the first beam is the last that it
    measured, and the time increment is negative. A beam has the shortest range of its samples, inf if all saw
    nothing, and NaN if there is none near it or it ends within the robot.
    """
    first, step = lidar.angle_min, lidar.angle_increment
    measured = np.where(turn.ranges < lidar.range_min, math.nan, turn.ranges)  # too near to be measured
    measured = np.where(measured > lidar.range_max, math.inf, measured)
    ranges = own_body.without(beams_of(turn.bearings, measured, first, step, lidar.beams), lidar.range_min)
    end_ns, period = _line_through(turn)
    increment = -period * step / (2.0 * math.pi)
    first_ns = round(end_ns + increment * 1e9 * (first + math.pi) / step)
    limits = lidar.range_min, lidar.range_max
    last = lidar.angle_max
    return LaserScan(Header.of(first_ns, frame), first, last, step, increment, period, *limits, ranges)


def _line_through(turn: Samples) -> tuple[float, float]:
    """Return the time at bearing -pi, ns, and the period of a turn, s, by a line through the samples' times."""
    times = (turn.times_ns - turn.times_ns[0]).astype(np.float64)
    slope, at_zero = np.polyfit(turn.bearings, times, 1)
    return float(turn.times_ns[0] + at_zero - math.pi * slope), -2.0 * math.pi * float(slope) / 1e9
