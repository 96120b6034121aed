"""Detection of glass walls in planar scans.

Glass returns a laser beam that meets it at nearly a right angle, and lets all others pass (Foster, Sun, Park and
Kuipers: VisAGGE, visible angle grid for glass environments, ICRA 2013). A scan shows a few points of it, at the foot
of the perpendicular from the sensor, with free space on both sides. While the robot drives, they slide along the
wall, as points of nothing else do: what stands stays where it is.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.reflections import find_reflections
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan

Floats = NDArray[np.float64]

MAX_MOTION = 0.2
"""Maximum distance between the middles of a reflection in two scans, m."""
MAX_GAP = 1.0
"""Time without a reflection after which its track ends, s."""
TRACK_LENGTH, SPACING = 30, 0.02
"""Number of reflections that a track keeps, and the minimum distance between the middles of two, m, or rad as seen by
the sensor if that is more."""
MIN_REFLECTIONS, MIN_TRAVEL = 5, 0.25
"""Minimum number of reflections of a glass wall, and of the distance over which they slid, m."""
MIN_ANGLE = 0.1
"""Minimum angle over which they slid, as seen by the sensor, rad."""
MAX_RESIDUAL = 0.02
"""Maximum standard deviation of the middles of reflections from a straight line, m."""
MAX_SLIP = 0.4
"""Maximum difference between the motions of reflections and of the sensor along the wall, share of the former."""
MAX_INCIDENCE, FOOT_MARGIN = 0.05, 0.03
"""Maximum distance of a middle from the foot of the perpendicular: by the distance of the sensor, rad; added, m."""
KNOWN_WALLS = 200
"""Number of points of glass walls that are remembered."""
WALL_SPACING, WALL_LENGTH, WALL_DEPTH = 0.3, 1.0, 0.2
"""Distance between such points, and how far from one a reflection is of the same wall, along it and across, m: a wall
may be known from its other side."""


class Reflection(NamedTuple):
    """Neighbouring points of a scan with free space on both sides.

    beams: their numbers. points: (n, 2), middle: (2,) of them, sensor: (2,), m.
    """

    beams: slice
    points: Floats
    middle: Floats
    sensor: Floats


class GlassPoints(NamedTuple):
    """Points (n, 2) of a glass wall, m, and the direction of its normal, rad, modulo pi."""

    points: Floats
    normal: float


class _Track:
    """A reflection followed from scan to scan."""

    def __init__(self, reflection: Reflection, time: float) -> None:
        self.middle, self.time = reflection.middle, time
        self.reflections = [reflection]

    def add(self, reflection: Reflection, time: float) -> bool:
        """Add a reflection; return whether it has moved."""
        self.middle, self.time = reflection.middle, time
        spacing = SPACING * max(1.0, math.dist(reflection.middle, reflection.sensor))
        if math.dist(reflection.middle, self.reflections[-1].middle) < spacing:
            return False
        self.reflections = [*self.reflections[1 - TRACK_LENGTH :], reflection]
        return True

    def normal(self) -> float | None:
        """Return the normal of the glass wall that the reflections are of, rad, or None.

        Their middles lie on a line and move as the sensor does, each at the foot of its perpendicular.
        """
        if len(self.reflections) < MIN_REFLECTIONS:
            return None
        middles = np.array([reflection.middle for reflection in self.reflections])
        centred = middles - middles.mean(axis=0)
        # the line of least squares: its direction is the eigenvector of the larger eigenvalue
        variances, axes = np.linalg.eigh(centred.T @ centred / len(middles))
        away = (middles - np.array([reflection.sensor for reflection in self.reflections])) @ axes
        travel, slip = np.ptp(centred @ axes[:, 1]), np.ptp(away[:, 1])
        min_travel = max(MIN_TRAVEL, MIN_ANGLE * abs(away[-1, 0]))
        if variances[0] > MAX_RESIDUAL**2 or travel < min_travel or slip > MAX_SLIP * travel:
            return None
        normal = math.atan2(axes[1, 0], axes[0, 0])
        return normal if all(_is_at_foot(reflection, normal) for reflection in self.reflections) else None


class GlassDetector:
    """Finds walls of glass in the scans of a moving lidar.

    beams: those of the newest scan that glass has returned.
    """

    def __init__(self) -> None:
        self.beams: list[slice] = []
        self._tracks: list[_Track] = []
        self._walls: Floats = np.zeros((0, 3))
        """Points of known walls of glass, x and y, m, and the normals there, rad."""

    def without_glass(self, sensor: SE2, scan: LaserScan, replacement: float = math.nan) -> LaserScan:
        """Return a scan without the beams that glass returns: they move with the robot, as if it stood.

        replacement: their range, NaN for unknown, or inf for no return.
        """
        self.process_scan(sensor, scan)
        if not self.beams:
            return scan
        ranges = scan.ranges.copy()
        for beams in self.beams:
            ranges[beams] = replacement
        return msgspec.structs.replace(scan, ranges=ranges)

    def process_scan(self, sensor: SE2, scan: LaserScan) -> list[GlassPoints]:
        """Return what a scan adds to the walls of glass, in the frame of the sensor's pose."""
        return self.process(sensor, *beams_of(scan), scan.header.stamp.ns / 1e9)

    def process(self, sensor: SE2, angles: Floats, ranges: Floats, time: float) -> list[GlassPoints]:
        """Return what a scan adds to the walls of glass, in the frame of the sensor's pose.

        angles, ranges: (n,) rad, m; a range of inf is no return, NaN is invalid. time: of the scan, s.
        """
        found, self.beams = [], []
        self._tracks = [track for track in self._tracks if abs(time - track.time) <= MAX_GAP]
        for first, last in find_reflections(angles, ranges).tolist():
            reflection = _reflection(sensor, angles, ranges, slice(first, last))
            glass = self._glass_of(reflection, time)
            if glass is not None:
                self.beams.append(reflection.beams)
                self._remember(reflection, glass.normal)
                found.append(glass)
        return found

    def _glass_of(self, reflection: Reflection, time: float) -> GlassPoints | None:
        """Return the points that a reflection adds to a wall of glass, all of its track if the wall is new."""
        track, moved = self._track_of(reflection, time), True
        if track is None:
            track = _Track(reflection, time)
            self._tracks.append(track)
        else:
            moved = track.add(reflection, time)
        known = self._known_normal(reflection)
        if known is not None:
            return GlassPoints(reflection.points, known)
        normal = track.normal() if moved else None
        return (
            None if normal is None else GlassPoints(np.vstack([r.points for r in track.reflections]), normal)
        )

    def _track_of(self, reflection: Reflection, time: float) -> _Track | None:
        """Return the nearest track that a reflection continues, None if it continues none."""
        open_tracks = [track for track in self._tracks if track.time < time]
        nearest = min(open_tracks, key=lambda track: math.dist(reflection.middle, track.middle), default=None)
        if nearest is None or math.dist(reflection.middle, nearest.middle) > MAX_MOTION:
            return None
        return nearest

    def _known_normal(self, reflection: Reflection) -> float | None:
        """Return the normal of the known wall that a reflection is of, rad, None if it is of none."""
        along, across = _components(reflection.middle - self._walls[:, :2], self._walls[:, 2])
        for normal in self._walls[(along <= WALL_LENGTH) & (across <= WALL_DEPTH), 2].tolist():
            if _is_at_foot(reflection, normal):
                return float(normal)
        return None

    def _remember(self, reflection: Reflection, normal: float) -> None:
        away = self._walls[:, :2] - reflection.middle
        if (np.hypot(away[:, 0], away[:, 1]) > WALL_SPACING).all():
            self._walls = np.vstack([self._walls[1 - KNOWN_WALLS :], [*reflection.middle, normal]])


def beams_of(scan: LaserScan) -> tuple[Floats, Floats]:
    """Return angles and ranges (n,), rad and m, of a scan: inf is no return, NaN is invalid."""
    ranges = scan.ranges.astype(np.float64)
    ranges[ranges >= scan.range_max] = np.inf
    ranges[ranges < scan.range_min] = np.nan
    return scan.angles.astype(np.float64), ranges


def _reflection(sensor: SE2, angles: Floats, ranges: Floats, beams: slice) -> Reflection:
    valid = ~np.isnan(ranges[beams])
    bearings, distances = angles[beams][valid], ranges[beams][valid]
    points = sensor.apply(np.column_stack([distances * np.cos(bearings), distances * np.sin(bearings)]))
    return Reflection(beams, points, points.mean(axis=0), np.array([sensor.x, sensor.y]))


def _is_at_foot(reflection: Reflection, normal: float) -> bool:
    """Return whether a reflection is at the foot of the perpendicular from its sensor to a wall, normal in rad."""
    from_foot, distance = _components(reflection.middle - reflection.sensor, normal)
    return bool(from_foot <= MAX_INCIDENCE * distance + FOOT_MARGIN)


def _components(vectors: Floats, normals: Floats | float) -> tuple[Any, Any]:
    """Return the amounts of vectors (..., 2) along walls with normals (...), rad, and across them."""
    x, y, c, s = vectors[..., 0], vectors[..., 1], np.cos(normals), np.sin(normals)
    return abs(c * y - s * x), abs(c * x + s * y)
