"""Detection of glass walls in planar scans.

Glass returns a laser beam that meets it at nearly a right angle, and lets all others pass (Foster, Sun, Park and
Kuipers: VisAGGE, visible angle grid for glass environments, ICRA 2013). A scan shows a few points of it, at the foot
of the perpendicular from the sensor, with free space on both sides. While the robot drives, they slide along the
wall, as points of nothing else do: what stands stays where it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan

Floats = NDArray[np.float64]

MAX_STEP = 0.1
"""Maximum difference between the ranges of neighbouring points of one reflection, m."""
MIN_DEPTH = 0.3
"""Minimum distance from a reflection to what the beams beside it measure, m."""
MIN_POINTS = 3
"""Minimum number of points of a reflection."""
MAX_WIDTH = 0.5
"""Maximum angle that a reflection takes up, rad: wider ones are seen at other angles, too."""
MAX_DISTANCE = 3.0
"""Maximum distance of a reflection, m."""
MAX_MOTION = 0.2
"""Maximum distance between the middles of a reflection in two scans, m."""
MAX_GAP = 1.0
"""Time without a reflection after which its track ends, s."""
TRACK_LENGTH, SPACING = 30, 0.02
"""Number of reflections that a track keeps, and the minimum distance between the middles of two, m."""
MIN_REFLECTIONS, MIN_TRAVEL = 5, 0.25
"""Minimum number of reflections of a glass wall, and of the distance over which they slid, m."""
MAX_RESIDUAL = 0.02
"""Maximum standard deviation of the middles of reflections from a straight line, m."""
MAX_INCIDENCE, FOOT_MARGIN = 0.05, 0.03
"""Maximum distance of a middle from the foot of the perpendicular: by the distance of the sensor, rad; added, m."""


class Reflection(NamedTuple):
    """Neighbouring points of a scan with free space on both sides: points (n, 2) and their middle (2,), m."""

    beams: slice
    points: Floats
    middle: Floats


class GlassPoints(NamedTuple):
    """Points (n, 2) of a glass wall, m, and the direction of its normal, rad, modulo pi."""

    points: Floats
    normal: float


class _Track:
    """A reflection followed from scan to scan."""

    def __init__(self, reflection: Reflection, sensor: SE2, time: float) -> None:
        self.middle, self.time, self.confirmed = reflection.middle, time, False
        self.reflections, self.sensors = [reflection], [(sensor.x, sensor.y)]

    def add(self, reflection: Reflection, sensor: SE2, time: float) -> GlassPoints | None:
        """Return the points of glass that a reflection adds, all of the track once it is confirmed."""
        self.middle, self.time = reflection.middle, time
        if _distance(reflection, self.reflections[-1].middle) < SPACING:
            return None
        self.reflections = [*self.reflections[1 - TRACK_LENGTH :], reflection]
        self.sensors = [*self.sensors[1 - TRACK_LENGTH :], (sensor.x, sensor.y)]
        normal = _glass_normal(np.array([r.middle for r in self.reflections]), np.array(self.sensors))
        new = self.reflections[-1:] if self.confirmed else self.reflections
        self.confirmed = normal is not None
        if normal is None:
            return None
        return GlassPoints(np.vstack([r.points for r in new]), normal)


class GlassDetector:
    """Finds walls of glass in the scans of a moving lidar.

    beams: those of the newest scan that glass has returned.
    """

    def __init__(self) -> None:
        self.beams: list[slice] = []
        self._tracks: list[_Track] = []

    def process_scan(self, sensor: SE2, scan: LaserScan) -> list[GlassPoints]:
        """Return what a scan adds to the walls of glass, in the frame of the sensor's pose."""
        return self.process(sensor, *beams_of(scan), scan.header.stamp.ns / 1e9)

    def without_glass(self, sensor: SE2, scan: LaserScan) -> LaserScan:
        """Return a scan without the beams that glass returns: they move with the robot, as if it stood."""
        self.process_scan(sensor, scan)
        if not self.beams:
            return scan
        ranges = scan.ranges.copy()
        for beams in self.beams:
            ranges[beams] = np.nan
        return msgspec.structs.replace(scan, ranges=ranges)

    def process(self, sensor: SE2, angles: Floats, ranges: Floats, time: float) -> list[GlassPoints]:
        """Return what a scan adds to the walls of glass, in the frame of the sensor's pose.

        angles, ranges: (n,) rad, m; a range of inf is no return, NaN is invalid. time: of the scan, s.
        """
        found, self.beams = [], []
        self._tracks = [track for track in self._tracks if abs(time - track.time) <= MAX_GAP]
        for reflection in reflections(sensor, angles, ranges):
            track = self._track_of(reflection, time)
            if track is None:
                self._tracks.append(_Track(reflection, sensor, time))
                continue
            glass = track.add(reflection, sensor, time)
            if track.confirmed:
                self.beams.append(reflection.beams)
            if glass is not None:
                found.append(glass)
        return found

    def _track_of(self, reflection: Reflection, time: float) -> _Track | None:
        """Return the nearest track that a reflection continues, None if it continues none."""
        open_tracks = [track for track in self._tracks if track.time < time]
        nearest = min(open_tracks, key=lambda track: _distance(reflection, track.middle), default=None)
        if nearest is None or _distance(reflection, nearest.middle) > MAX_MOTION:
            return None
        return nearest


def beams_of(scan: LaserScan) -> tuple[Floats, Floats]:
    """Return angles and ranges (n,), rad and m, of a scan: inf is no return, NaN is invalid."""
    ranges = scan.ranges.astype(np.float64)
    ranges[ranges >= scan.range_max] = np.inf
    ranges[ranges < scan.range_min] = np.nan
    return scan.angles.astype(np.float64), ranges


def reflections(sensor: SE2, angles: Floats, ranges: Floats) -> list[Reflection]:
    """Return the reflections in a scan (n,), rad, m, that may be glass, in the frame of the sensor's pose.

    One that lies across the first and the last beam is not found.
    """
    with np.errstate(invalid="ignore"):
        connected = np.abs(np.diff(ranges)) <= MAX_STEP  # false for inf and NaN
    edges = np.diff(connected.astype(np.int8), prepend=0, append=0)
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    long = ends - starts + 1 >= MIN_POINTS
    inside = (starts > 0) & (ends < len(ranges) - 1) & long
    found = []
    for first, last in zip(starts[inside].tolist(), ends[inside].tolist(), strict=True):
        farthest = ranges[first : last + 1].max()
        is_free = min(ranges[first - 1], ranges[last + 1]) >= farthest + MIN_DEPTH  # false for NaN
        if is_free and farthest <= MAX_DISTANCE and abs(angles[last] - angles[first]) <= MAX_WIDTH:
            found.append(_reflection(sensor, angles, ranges, slice(first, last + 1)))
    return found


def _distance(reflection: Reflection, point: Floats) -> float:
    return math.hypot(*(reflection.middle - point))


def _reflection(sensor: SE2, angles: Floats, ranges: Floats, beams: slice) -> Reflection:
    directions = np.column_stack([np.cos(angles[beams]), np.sin(angles[beams])])
    points = sensor.apply(ranges[beams, None] * directions)
    return Reflection(beams, points, points.mean(axis=0))


def _glass_normal(middles: Floats, sensors: Floats) -> float | None:
    """Return the normal of the glass wall, rad, whose reflections had their middles (n, 2) seen from (n, 2), or None.

    The middles lie on a line, and each at the foot of the perpendicular from its sensor.
    """
    if len(middles) < MIN_REFLECTIONS:
        return None
    centred = middles - middles.mean(axis=0)
    # the line of least squares: its direction is the eigenvector of the larger eigenvalue
    variances, axes = np.linalg.eigh(centred.T @ centred / len(middles))
    along = axes[:, 1]
    travel = np.ptp(centred @ along)
    if travel < MIN_TRAVEL or variances[0] > MAX_RESIDUAL**2:
        return None
    from_foot = np.abs((middles - sensors) @ along)
    distance = np.abs((middles - sensors) @ axes[:, 0])
    if (from_foot > MAX_INCIDENCE * distance + FOOT_MARGIN).any():
        return None
    return float(np.arctan2(axes[1, 0], axes[0, 0]))
