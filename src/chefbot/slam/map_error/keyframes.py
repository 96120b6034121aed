"""Scans at even distances along the drives, with their surface points in the map: what a map is checked with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ScanError
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.graph.surface_grid import transformed
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.scan_beams import beams_of
from chefbot.slam.session import Session

SPACING, MAX_KEYFRAMES = 1.0, 400
"""Travel between two keyframes, m; it grows so that there are at most so many."""
POINTS = 60
"""Largest number of surface points of a keyframe, at even spacing along the walls."""
REACH = 15.0
"""Distance from the sensor up to which points and views count, m: an error of the heading moves farther ones most."""
BINS = 720
"""Bearings of a keyframe's polar view."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Keyframes:
    """n scans with their poses in the map, m and rad.

    poses: (n, 3), of the robot. sensors: (n, 3), of the laser. travel: (n,) length of the trajectory up to each, m.
    drive: (n,) number of the drive. views: (n, BINS) range by bearing in the frame of the sensor, from -pi on, m; NaN
    where there is no return. points, normals: (n, POINTS, 2), in the map. counts: (n,) number of points.
    """

    poses: Floats
    sensors: Floats
    travel: Floats
    drive: NDArray[np.int64]
    views: NDArray[np.float32]
    points: Floats
    normals: Floats
    counts: NDArray[np.int64]

    def __len__(self) -> int:
        """Return the number of keyframes."""
        return len(self.poses)


def select_keyframes(sessions: Sequence[Session], poses: Sequence[SE2], range_offset: float) -> Keyframes:
    """Return the keyframes of a map's drives; poses: of all used scans; range_offset: correction of ranges, m.

    Raises ScanError if there are fewer scans than poses, as when some were lost on their way.
    """
    scans, lasers, limits, drive = [], [], [], []
    for number, session in enumerate(sessions):
        used = [scan for scan in session.scans() if len(scan.ranges)]
        scans += used
        lasers += [SE2.of(session.laser)] * len(used)
        limits += [session.range_max] * len(used)
        drive += [number] * len(used)
    if len(scans) < len(poses):
        raise ScanError(f"a map of {len(poses)} poses has only {len(scans)} scans")
    travel = _travel(poses)
    chosen = _evenly(travel, drive)
    n = len(chosen)
    views = np.full((n, BINS), np.nan, np.float32)
    points, normals = np.zeros((n, POINTS, 2)), np.zeros((n, POINTS, 2))
    counts = np.zeros(n, np.int64)
    for k, i in enumerate(chosen):
        scan = _within(scans[i], limits[i], range_offset)
        views[k] = polar_view(scan.angles, scan.ranges)
        surface, across = _surface(scan, lasers[i], poses[i])
        counts[k] = len(surface)
        points[k, : counts[k]], normals[k, : counts[k]] = surface, across
    at = np.array([poses[i].array() for i in chosen])
    sensors = np.array([(poses[i] @ lasers[i]).array() for i in chosen])
    return Keyframes(at, sensors, travel[chosen], np.array(drive)[chosen], views, points, normals, counts)


def _travel(poses: Sequence[SE2]) -> Floats:
    path = np.array([(pose.x, pose.y) for pose in poses])
    steps = np.hypot(*np.diff(path, axis=0).T) if len(path) > 1 else np.zeros(0)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _evenly(travel: Floats, drive: Sequence[int]) -> list[int]:
    """Return the indices of scans at even distances, from the first one of each drive on."""
    spacing = max(SPACING, float(travel[-1]) / MAX_KEYFRAMES)
    chosen = [0]
    for i in range(1, len(travel)):
        if travel[i] - travel[chosen[-1]] >= spacing or drive[i] != drive[chosen[-1]]:
            chosen.append(i)
    return chosen


def _within(scan: RecordedScan, range_max: float, range_offset: float) -> RecordedScan:
    """Return the scan with corrected ranges, NaN for those that are no return."""
    valid = (scan.ranges > 0.0) & (scan.ranges < range_max)
    ranges = np.where(valid, scan.ranges + np.float32(range_offset), np.float32(np.nan)).astype(np.float32)
    return RecordedScan(scan.stamp, scan.angles, ranges, scan.laser, scan.odom)


def polar_view(angles: NDArray[np.float32], ranges: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (BINS,) ranges by bearing from -pi on: in each bin that of the nearest beam, NaN where none is near."""
    bearings = np.array([wrap(float(a)) for a in angles])
    order = np.argsort(bearings, kind="stable")
    sorted_bearings, sorted_ranges = bearings[order], ranges[order]
    spacing = abs(float(angles[-1]) - float(angles[0])) / max(len(angles) - 1, 1)
    centres = (np.arange(BINS) + 0.5) * (2.0 * math.pi / BINS) - math.pi
    after = np.searchsorted(sorted_bearings, centres) % len(order)
    nearest = np.where(_apart(sorted_bearings[after - 1], centres) < _apart(sorted_bearings[after], centres),
                       after - 1, after)  # fmt: skip
    near = _apart(sorted_bearings[nearest], centres) <= max(0.75 * spacing, math.pi / BINS)
    view: NDArray[np.float32] = np.where(near, sorted_ranges[nearest], np.float32(np.nan)).astype(np.float32)
    return view


def _apart(a: NDArray[np.floating[Any]], b: NDArray[np.floating[Any]]) -> Floats:
    """Return the angles between bearings, rad."""
    difference: Floats = np.abs((a - b + math.pi) % (2.0 * math.pi) - math.pi)
    return difference


def _surface(scan: RecordedScan, laser: SE2, pose: SE2) -> tuple[Floats, Floats]:
    """Return at most POINTS points on lines and their normals, both (m, 2), in the map."""
    features = ScanFeatures.of(beams_of(scan.angles, scan.ranges, laser, REACH, 0.0), REACH)
    on_line = np.flatnonzero(features.normals.any(axis=1))
    if len(on_line) > POINTS:
        on_line = on_line[np.linspace(0, len(on_line) - 1, POINTS).astype(int)]
    array = pose.array()
    turned = transformed(features.normals[on_line], np.array([0.0, 0.0, array[2]]))
    return transformed(features.points[on_line], array), turned
