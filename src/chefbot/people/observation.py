"""What one sensor message shows, as beams in a plane."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan

Floats = NDArray[np.float64]
MIN_HEIGHT_EXTENT = 0.25
"""Height interval that an obstacle of a depth image must show to belong to a person, m: a leg, but no table top."""


class Observation(NamedTuple):
    """n beams from one point, in the order of their angles.

    sensor: pose in the tracking frame. angles: (n,) rad. ranges: (n,) distance of the return, m, NaN for none. start,
    end: (n,) interval of each beam that is free, m; empty, with end 0, if that is unknown. upright: (n,)
    whether the return may belong to a person by its height.
    """

    sensor: SE2
    angles: Floats
    ranges: Floats
    start: Floats
    end: Floats
    upright: NDArray[np.bool_]

    @property
    def spacing(self) -> float:
        """Angle between neighbouring beams, rad; 0 for less than two."""
        return abs(float(self.angles[1] - self.angles[0])) if len(self.angles) > 1 else 0.0

    @property
    def is_usable(self) -> bool:
        """Whether there are beams at distinct, finite, increasing angles, from a finite pose."""
        step = float(self.angles[1] - self.angles[0]) if len(self.angles) > 1 else math.nan
        return bool(np.isfinite(self.sensor).all()) and step > 0.0 and math.isfinite(float(self.angles[-1]))

    def reversed(self) -> Observation:
        """Return the same beams in the opposite order."""
        return Observation(
            self.sensor,
            np.ascontiguousarray(self.angles[::-1]),
            np.ascontiguousarray(self.ranges[::-1]),
            np.ascontiguousarray(self.start[::-1]),
            np.ascontiguousarray(self.end[::-1]),
            np.ascontiguousarray(self.upright[::-1]),
        )

    def points(self) -> Floats:
        """Return the returns in the tracking frame, (n, 2), NaN for none."""
        bearing = self.angles + self.sensor.yaw
        x, y = self.sensor.x + self.ranges * np.cos(bearing), self.sensor.y + self.ranges * np.sin(bearing)
        return np.column_stack([x, y])


def _angles(first: float, step: float, count: int) -> Floats:
    return np.asarray(first + np.arange(count) * step, np.float64)


def observe_scan(scan: LaserScan, sensor: SE2) -> Observation:
    """Return the beams of a laser scan: NaN, zero and negative ranges show nothing, +inf free floor (REP-117)."""
    ranges = scan.ranges.astype(np.float64)
    with np.errstate(invalid="ignore"):
        hit = (ranges > 0.0) & (ranges >= scan.range_min) & (ranges < scan.range_max)
        free = np.where(ranges >= scan.range_max, float(scan.range_max), 0.0)
    end = np.where(hit, ranges, free)
    angles = _angles(scan.angle_min, scan.angle_increment, len(ranges))
    seen = np.where(hit, ranges, np.nan)
    n = len(ranges)
    beams = Observation(sensor, angles, seen, np.zeros(n), end, np.ones(n, np.bool_))
    return beams if scan.angle_increment >= 0.0 else beams.reversed()  # some lidars turn clockwise


def observe_obstacles(scan: ObstacleScan, sensor: SE2) -> Observation:
    """Return the bins of an obstacle scan as beams; they are free where the floor was seen."""
    n = len(scan.ranges)
    ranges = scan.ranges.astype(np.float64)
    with np.errstate(invalid="ignore"):
        hit = (ranges > 0.0) & (ranges < scan.range_max)
        upright = np.ones(n, np.bool_)
        if len(scan.bottom) == n and len(scan.top) == n:
            upright = (scan.top - scan.bottom >= MIN_HEIGHT_EXTENT) & (scan.bottom >= 0.0)
        start, end = scan.clear_from.astype(np.float64), scan.clear_to.astype(np.float64)
        known = np.isfinite(start) & (end > start)
    angles = _angles(scan.angle_min, scan.angle_increment, n)
    start, end = (
        np.where(known, start, 0.0),
        np.where(known, np.fmin(end, np.where(hit, ranges, scan.range_max)), 0.0),
    )
    beams = Observation(sensor, angles, np.where(hit, ranges, np.nan), start, end, upright)
    return beams if scan.angle_increment >= 0.0 else beams.reversed()
