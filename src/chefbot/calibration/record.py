"""Record of a calibration drive while it goes on: encoder counts, gyro, and the stations' scans."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.calibration.alignment import localize_station
from chefbot.calibration.drive import DriveSegment, Station
from chefbot.calibration.surface import Surface
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.sensor_msgs import LaserScan

SCANS_PER_STATION = 10
"""Scans per station; their mean is matched."""
SELF_FILTER_MARGIN = 0.05
"""Margin around the footprint within which lidar returns are filtered as the robot's own tubes, m."""
MIN_VALID_FRACTION, MAX_RANGE_SPREAD = 0.7, 0.06
"""Minimum fraction of a station's scans with a valid range, per beam, and maximum deviation of these ranges
relative to their mean (at least 1 m): at edges some scans hit the foreground and some the background."""
MAX_GYRO_GAP_NS = 1_000_000_000
"""Maximum time between two gyro readings that are integrated, ns."""


class Motion(NamedTuple):
    """What wheels and gyro measured between two stations: counts (n, 2), angle (rad) and duration (s)."""

    ticks: NDArray[np.float64]
    angle: float
    seconds: float


class MotionRecorder:
    """Records encoder counts and integrates the gyro from one station to the next. Times are in ns."""

    def __init__(self) -> None:
        self._ticks: list[tuple[int, int]] = []
        self._gyro_ns: int | None = None
        self._angle = self._seconds = 0.0

    def restart(self) -> None:
        """Start the next motion, with the last counts of this one."""
        self._ticks = self._ticks[-1:]
        self._angle = self._seconds = 0.0

    def add_ticks(self, left: int, right: int) -> None:
        """Add the counts of both encoders."""
        self._ticks.append((left, right))

    def add_rate(self, rate: float, stamp_ns: int) -> None:
        """Add the gyro's turn rate (rad/s), which is the mean since the previous reading."""
        last_ns, self._gyro_ns = self._gyro_ns, stamp_ns
        if last_ns is not None and 0 < stamp_ns - last_ns < MAX_GYRO_GAP_NS:
            self._angle += rate * (stamp_ns - last_ns) / 1e9
            self._seconds += (stamp_ns - last_ns) / 1e9

    @property
    def motion(self) -> Motion:
        """The motion since the last station."""
        return Motion(np.array(self._ticks, np.float64), self._angle, self._seconds)

    @property
    def counted(self) -> tuple[int, int]:
        """The ranges of the left and right counts since the last station."""
        left, right = np.ptp(np.array(self._ticks or [(0, 0)]), axis=0)
        return int(left), int(right)


class StationRecorder:
    """Collects the scans of stations and places every station in the room of all previous ones.

    reach: maximum range used, m. circumscribed_radius: of the robot, m.
    """

    def __init__(self, reach: float, circumscribed_radius: float) -> None:
        self._reach, self._circumscribed_radius = reach, circumscribed_radius
        self.stations: list[Station] = []
        self.sensor_pose = IDENTITY
        """Pose of the sensor in the room, tracked between stations."""
        self.hit_ratio = 0.0
        """Fraction of the beams that hit a wall at the last station."""
        self.field_of_view = 2.0 * math.pi
        """Field of view of the sensor at the last station, rad."""
        self._surfaces: list[Surface] = []
        self._room_T_tracker = IDENTITY
        self._scans: list[tuple[SE2, LaserScan]] | None = None

    def begin(self) -> None:
        """Begin to collect the scans of a station, at standstill."""
        self._scans = []

    def add(self, scan: LaserScan, tracker_pose: SE2) -> bool:
        """Add a scan with the sensor's pose by the tracker; return whether the station's scans are now complete."""
        self.sensor_pose = self._room_T_tracker @ tracker_pose
        if self._scans is None or len(self._scans) >= SCANS_PER_STATION:
            return False
        self._scans.append((self.sensor_pose, scan))
        return len(self._scans) == SCANS_PER_STATION

    def finish(self, mount: SE2) -> None:
        """Add the station from the collected scans, placed by matching it with all previous stations.

        mount: pose of the sensor in base_link. The tracker's drift, with odometry not calibrated yet, reaches 11
        degrees and 0.3 m in ten minutes.
        """
        assert self._scans, "a station without scans"
        scans, self._scans = self._scans, None
        tracked = mean_pose([pose for pose, _ in scans])
        walls = self._wall_points([scan for _, scan in scans], mount)
        surface = Surface(walls)
        poses = [station.pose for station in self.stations]
        self.sensor_pose = localize_station(surface, tracked, poses, self._surfaces)
        self._room_T_tracker = self.sensor_pose @ tracked.inverse() @ self._room_T_tracker
        self.stations.append(Station(self.sensor_pose, walls))
        self._surfaces.append(surface)

    def leg(self, motion: Motion) -> DriveSegment:
        """Return the leg between the last two stations with its motion."""
        n = len(self.stations)
        start, end = self.stations[-2].pose, self.stations[-1].pose
        return DriveSegment(motion.ticks, motion.angle, motion.seconds, start, end, (n - 2, n - 1))

    @property
    def walls(self) -> NDArray[np.float64]:
        """All wall points (n, 2) in the sensor's present frame."""
        points = np.concatenate([station.pose.apply(station.walls) for station in self.stations])
        return np.asarray(self.sensor_pose.inverse().apply(points))

    def _wall_points(self, scans: Sequence[LaserScan], mount: SE2) -> NDArray[np.float64]:
        """Return the wall points (n, 2) in the sensor's frame, from beams with consistent ranges off the robot."""
        ranges = np.array([scan.ranges for scan in scans], np.float64)
        ranges[~((ranges > 0.0) & (ranges < min(self._reach, scans[0].range_max)))] = np.nan
        valid = np.isfinite(ranges).sum(axis=0) >= MIN_VALID_FRACTION * len(scans)
        mean, angles = np.nanmean(ranges[:, valid], axis=0), scans[0].angles[valid].astype(np.float64)
        steady = np.nanmax(np.abs(ranges[:, valid] - mean), axis=0) < MAX_RANGE_SPREAD * np.maximum(mean, 1.0)
        points = (mean * (np.cos(angles), np.sin(angles))).T[steady]
        outside = np.hypot(*mount.apply(points).T) > self._circumscribed_radius + SELF_FILTER_MARGIN
        self.hit_ratio = float(valid.mean())
        self.field_of_view = scans[-1].angle_max - scans[-1].angle_min
        return np.asarray(points[outside])


def mean_pose(poses: Sequence[SE2]) -> SE2:
    """Return the mean of poses; headings are averaged on the circle."""
    mean = np.array([(p.x, p.y, math.cos(p.yaw), math.sin(p.yaw)) for p in poses]).mean(axis=0)
    return SE2(float(mean[0]), float(mean[1]), math.atan2(mean[3], mean[2]))
