"""Whether the wheels slip: the odometry moves, and the scans show that the robot does not."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan

MIN_TRAVEL, MAX_TRAVEL = 0.3, 1.0
"""Travel by odometry over which scans are compared, m; after a longer one between two scans the odometry jumped."""
MAX_AGE_NS = 9_000_000_000
"""Time between the two scans, ns, less than the cache of transforms: slower wheels are not judged."""
TOLERANCE = 0.06
"""Difference up to which a range is the expected one, m: noise of a cheap lidar, and the width of its beams."""
MIN_BEAMS = 15
"""Number of beams that must show a robot that stands."""
MIN_INCREMENT = 1e-5
"""Angle between two beams, rad, smaller than that of any lidar."""
MAX_OPPOSED = 0.1
"""Beams that show the travel, as a share of those; people who walk along with the robot are not all it sees."""
SLIPPING_SCANS = 3
"""Number of scans in a row that must show it."""


class PlacedScan(NamedTuple):
    """Points (n, 2) of a scan in the robot's frame, m, with the robot's pose in odom and the time, ns."""

    time_ns: int
    robot: SE2
    points: NDArray[np.float64]


class SlipDetector:
    """Compares each scan with one before `MIN_TRAVEL` of odometry, as if the robot had moved so, or only turned.

    A beam counts that fits one of the two and is far from the other. In a corridor without features both fit, and
    nothing is concluded. Turns are taken from the odometry, which has them from the gyro.
    """

    def __init__(self) -> None:
        self._scans: deque[PlacedScan] = deque()
        self._count = 0

    @property
    def is_slipping(self) -> bool:
        """Whether the last scans show that the robot has not moved while the odometry has."""
        return self._count >= SLIPPING_SCANS

    @property
    def standing_since_ns(self) -> int:
        """Time of the scan at which a robot whose wheels slip stood where it stands now, ns."""
        return self._scans[0].time_ns

    def reset(self) -> None:
        """Forget all scans, as after a motion has ended."""
        self._scans.clear()
        self._count = 0

    def process(self, scan: LaserScan, robot: SE2, mount: SE2) -> None:
        """Process a scan without skew; robot: pose in odom at its stamp. mount: pose of the sensor on the robot."""
        if len(scan.ranges) < MIN_BEAMS or abs(scan.angle_increment) < MIN_INCREMENT:
            return
        ranges = measured_ranges(scan)
        self._add(PlacedScan(scan.header.stamp.ns, robot, mount.apply(points_of(ranges, scan.angles))))
        before = self._scans[0]
        if before.robot.distance(robot) < MIN_TRAVEL:
            self._count = 0
            return
        points, turned = before.robot.apply(before.points), SE2(before.robot.x, before.robot.y, robot.yaw)
        moved = expected_ranges(points, robot @ mount, scan)
        stood = expected_ranges(points, turned @ mount, scan)
        self._count = self._count + 1 if shows_standstill(ranges, moved, stood) else 0

    def _add(self, scan: PlacedScan) -> None:
        """Keep a scan, the newest one `MIN_TRAVEL` before it, and those in between; none from before a jump."""
        newest = self._scans[-1] if self._scans else scan
        if scan.time_ns < newest.time_ns or scan.robot.distance(newest.robot) > MAX_TRAVEL:
            self.reset()
        self._scans.append(scan)
        while scan.time_ns - self._scans[0].time_ns > MAX_AGE_NS:
            self._scans.popleft()
        while len(self._scans) > 1 and scan.robot.distance(self._scans[1].robot) >= MIN_TRAVEL:
            self._scans.popleft()


def measured_ranges(scan: LaserScan) -> NDArray[np.float64]:
    """Return the ranges (n,) of a scan, m; NaN where nothing is measured."""
    ranges = scan.ranges.astype(np.float64)
    ranges[~((ranges > scan.range_min) & (ranges < scan.range_max))] = np.nan
    return ranges


def points_of(ranges: NDArray[np.float64], angles: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the points (k, 2) of the ranges (n,) that are measured, in the frame of the sensor, m."""
    valid = np.isfinite(ranges)
    at = angles[valid].astype(np.float64)
    return ranges[valid, None] * np.column_stack((np.cos(at), np.sin(at)))


def expected_ranges(points: NDArray[np.float64], sensor: SE2, scan: LaserScan) -> NDArray[np.float64]:
    """Return the ranges (n,) that a scan from a pose `sensor` would have by points (k, 2), m; NaN: unknown."""
    seen = sensor.inverse().apply(points)
    beams = np.rint((np.arctan2(seen[:, 1], seen[:, 0]) - scan.angle_min) / scan.angle_increment).astype(
        np.int64
    )
    beams %= round(2.0 * math.pi / abs(scan.angle_increment))
    inside = beams < len(scan.ranges)
    nearest = np.full(len(scan.ranges), np.inf)
    np.minimum.at(nearest, beams[inside], np.hypot(seen[inside, 0], seen[inside, 1]))
    nearest[np.isinf(nearest)] = np.nan
    return nearest


def difference(ranges: NDArray[np.float64], expected: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far ranges (n,) are from the expected ones of the same beam and its neighbours, m; NaN: unknown.

    Where a beam grazes a wall, its range changes by metres within the width of a beam.
    """
    near = np.stack((np.roll(expected, 1), expected, np.roll(expected, -1)))
    low, high = np.fmin.reduce(near), np.fmax.reduce(near)
    outside: NDArray[np.float64] = np.maximum(np.maximum(low - ranges, ranges - high), 0.0)
    return outside


def shows_standstill(
    ranges: NDArray[np.float64], moved: NDArray[np.float64], stood: NDArray[np.float64]
) -> bool:
    """Return whether ranges (n,) are those of a robot that stood, and not of one that moved; NaN: unknown."""
    from_moved, from_stood = difference(ranges, moved), difference(ranges, stood)
    for_travel = np.count_nonzero((from_moved < TOLERANCE) & (from_stood > 2.0 * TOLERANCE))
    for_standstill = np.count_nonzero((from_stood < TOLERANCE) & (from_moved > 2.0 * TOLERANCE))
    return bool(for_standstill >= MIN_BEAMS and for_travel <= MAX_OPPOSED * for_standstill)
