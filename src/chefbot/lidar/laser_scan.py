"""Turns of samples as laser scans."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.lidar.turns import Samples
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.sensors import Lidar

GAP = 1.5
"""Angle without a sample from which a beam has no range, as a multiple of the larger of the angle between beams and
that between samples."""


def scan_of(turn: Samples, lidar: Lidar, frame: str) -> LaserScan:
    """Return a turn as a scan with the beams of the robot file, counter-clockwise.

    The stamp is the time of the first beam; as the lidar turns clockwise, the first beam is the last that it
    measured, and the time increment is negative. A beam has the shortest range of its samples, inf if all saw
    nothing, and NaN if there is none near it.
    """
    step = lidar.angle_increment
    angles = np.asarray(lidar.angle_min + step * np.arange(lidar.beams), np.float64)
    ranges = _binned(turn, angles, step, lidar)
    end_ns, period = _line_through(turn)
    increment = -period * step / (2.0 * math.pi)
    first_ns = round(end_ns + increment * 1e9 * (angles[0] + math.pi) / step)
    limits = lidar.range_min, lidar.range_max
    last = float(angles[-1])
    return LaserScan(
        Header.of(first_ns, frame), float(angles[0]), last, step, increment, period, *limits, ranges
    )


def _binned(turn: Samples, angles: NDArray[np.float64], step: float, lidar: Lidar) -> NDArray[np.float32]:
    """Return the range of each beam (n,), m."""
    order = np.argsort(turn.bearings, kind="stable")
    bearings, measured = turn.bearings[order], turn.ranges[order]
    measured = np.where(measured < lidar.range_min, math.nan, measured)  # too near to be measured
    measured = np.where(measured > lidar.range_max, math.inf, measured)
    # the shortest range of the samples whose nearest beam it is
    beams = np.rint((bearings - angles[0]) / step).astype(np.int64)
    if lidar.full_turn:
        beams %= len(angles)
    inside = (beams >= 0) & (beams < len(angles)) & ~np.isnan(measured)
    ranges = np.full(len(angles), math.nan)
    np.fmin.at(ranges, beams[inside], measured[inside])
    # a beam between two samples has the range of the nearer one
    spacing = 2.0 * math.pi / max(len(bearings), 1)
    for beam in np.flatnonzero(np.isnan(ranges)).tolist():
        distance = np.abs(np.mod(bearings - angles[beam] + math.pi, 2.0 * math.pi) - math.pi)
        nearest = int(np.argmin(distance))
        if distance[nearest] <= GAP * max(step, spacing) / 2.0:
            ranges[beam] = measured[nearest]
    return ranges.astype(np.float32)


def _line_through(turn: Samples) -> tuple[float, float]:
    """Return the time at bearing -pi, ns, and the period of a turn, s, by a line through the samples' times."""
    times = (turn.times_ns - turn.times_ns[0]).astype(np.float64)
    slope, at_zero = np.polyfit(turn.bearings, times, 1)
    return float(turn.times_ns[0] + at_zero - math.pi * slope), -2.0 * math.pi * float(slope) / 1e9
