"""Surface points of a scan with their normals: what scan matching uses of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.slam.scan_beams import Beams

SPACING = np.float32(0.04)
"""Minimum distance between neighbouring points, m."""
_NEIGHBOURS, _EXTENT = 3, 0.25
"""Number of points on each side that a normal is fitted to, and their extent in m: the larger one decides."""
_GAP, _GAP_PER_RANGE = 0.15, 0.12
"""Largest gap between neighbours on one surface, m, and its growth with the range: grazed walls are sparse."""
_FLATNESS = 0.08
"""Largest root mean square distance of the neighbours from their line, m."""

OUTLINE_SPACING = 0.1
"""Spacing of the interpolated points, m."""
_MAX_INTERPOLATED = 40
"""Largest number of points between two neighbours."""
_MAX_ACROSS_COSINE = 0.2
"""Largest cosine of the angle between a normal and its surface."""


@dataclass(frozen=True, eq=False)
class ScanFeatures:
    """Points (n, 2) float32 in the base frame, m, in order of the beams, and their unit normals (n, 2)
    float32, towards the sensor.

    A normal of (0, 0) means that the neighbourhood is not a line. outline: (m, 2) float32, the points and, between
    neighbours on one line, points every OUTLINE_SPACING: the surfaces that a later scan may see between the beams.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    outline: NDArray[np.float32]
    reach: float
    """Distance in m within which nine tenths of the points lie."""

    bearings: NDArray[np.float32]
    """Direction (n,) of each point from the sensor, rad, ascending over at most one turn."""
    sensor: NDArray[np.float32]
    """Position (2,) of the sensor in the base frame, m."""
    range_offset: float
    """Correction that all ranges have got, m."""

    @staticmethod
    def of(beams: Beams, max_range: float, range_offset: float = 0.0) -> ScanFeatures:
        """Extract the points nearer than `max_range` m to the sensor, with `range_offset` m added to their ranges."""
        surfaces, bearings = _ordered(beams.surfaces, beams.sensor, max_range)
        surfaces = surfaces + np.float32(range_offset) * directions(surfaces, beams.sensor)
        points, kept = thinned_points(surfaces, SPACING)
        normals = normals_of(points, beams.sensor)
        outline = outline_of(points, normals, beams.sensor)
        distance = np.sort(np.hypot(points[:, 0], points[:, 1]))
        reach = float(distance[int(0.9 * (len(distance) - 1))]) if len(distance) else 0.0
        return ScanFeatures(points, normals, outline, reach, bearings[kept], beams.sensor, range_offset)


def directions(points: NDArray[np.float32], sensor: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the unit vectors (n, 2) of the beams from the sensor (2,) or (n, 2) to points (n, 2)."""
    offset = points - sensor
    length = np.hypot(offset[:, 0], offset[:, 1])
    return (offset / np.maximum(length, np.float32(1e-6))[:, None]).astype(np.float32)


def _ordered(
    surfaces: NDArray[np.float32], sensor: NDArray[np.float32], max_range: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the points (n, 2) within `max_range` m of the sensor and their bearings (n,), ascending.

    The beams of a laser that is mounted upside down run clockwise.
    """
    offset = surfaces - sensor
    near = np.hypot(offset[:, 0], offset[:, 1]) <= max_range
    surfaces, offset = surfaces[near], offset[near]
    bearings = np.unwrap(np.arctan2(offset[:, 1], offset[:, 0]))
    order = np.argsort(bearings, kind="stable")
    return surfaces[order], bearings[order].astype(np.float32)


@njit(cache=True, nogil=True)
def thinned_points(points, spacing):  # type: ignore[no-untyped-def]
    """Return the points (m, 2) at least `spacing` m from the last one kept, and their indices (m,)."""
    kept = np.empty(len(points), np.int64)
    m = 0
    for i in range(len(points)):
        if m == 0 or _distance(points, i, kept[m - 1]) >= spacing:
            kept[m] = i
            m += 1
    return points[kept[:m]], kept[:m].copy()


@njit(cache=True, nogil=True)
def normals_of(points, sensor):  # type: ignore[no-untyped-def]
    """Return the unit normals (n, 2) float32 of points (n, 2) in order of the beams; (0, 0) where none exists."""
    n = len(points)
    normals = np.zeros((n, 2), np.float32)
    for i in range(n):
        gap = _GAP + _GAP_PER_RANGE * math.hypot(points[i, 0] - sensor[0], points[i, 1] - sensor[1])
        # Extent of the surface on both sides: until a gap or the maximum number of neighbours
        first, last = i, i
        while first > 0 and _distance(points, first, first - 1) < gap:
            if i - first >= _NEIGHBOURS and _distance(points, first, i) >= _EXTENT:
                break
            first -= 1
        while last < n - 1 and _distance(points, last, last + 1) < gap:
            if last - i >= _NEIGHBOURS and _distance(points, last, i) >= _EXTENT:
                break
            last += 1
        if last - first < 2:
            continue
        # Covariance of the neighbourhood
        mean_x, mean_y, count = 0.0, 0.0, last - first + 1
        for k in range(first, last + 1):
            mean_x += points[k, 0] / count
            mean_y += points[k, 1] / count
        xx, xy, yy = 0.0, 0.0, 0.0
        for k in range(first, last + 1):
            dx, dy = points[k, 0] - mean_x, points[k, 1] - mean_y
            xx += dx * dx / count
            xy += dx * dy / count
            yy += dy * dy / count
        # Smaller eigenvalue: mean squared distance from the line
        spread = math.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
        smaller, larger = 0.5 * (xx + yy) - spread, 0.5 * (xx + yy) + spread
        if smaller > _FLATNESS**2 or smaller > 0.1 * larger:
            continue
        # Direction of the line by the angle of the larger eigenvector, the normal is across
        angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
        nx, ny = -math.sin(angle), math.cos(angle)
        # Towards the sensor: both sides of a thin wall differ
        if nx * (sensor[0] - points[i, 0]) + ny * (sensor[1] - points[i, 1]) < 0.0:
            nx, ny = -nx, -ny
        normals[i, 0], normals[i, 1] = nx, ny
    return normals


@njit(cache=True, nogil=True)
def outline_of(points, normals, sensor):  # type: ignore[no-untyped-def]
    """Return the points (n, 2) and interpolated ones between neighbours on one line, (m, 2) float32."""
    n, m = len(points), 0
    outline = np.empty((n + _MAX_INTERPOLATED * max(n, 1), 2), np.float32)
    for i in range(n):
        outline[m, 0], outline[m, 1] = points[i, 0], points[i, 1]
        m += 1
        if i + 1 == n:
            break
        length = _distance(points, i, i + 1)
        reach = math.hypot(points[i, 0] - sensor[0], points[i, 1] - sensor[1])
        if length <= OUTLINE_SPACING or length > _GAP + _GAP_PER_RANGE * reach:
            continue
        # Both normals must be across the segment: the neighbours then lie on one line
        dx, dy = (points[i + 1, 0] - points[i, 0]) / length, (points[i + 1, 1] - points[i, 1]) / length
        if not _is_across(normals, i, dx, dy) or not _is_across(normals, i + 1, dx, dy):
            continue
        pieces = min(int(length / OUTLINE_SPACING) + 1, _MAX_INTERPOLATED)
        for k in range(1, pieces):
            t = np.float32(k / pieces)
            outline[m, 0] = points[i, 0] + t * (points[i + 1, 0] - points[i, 0])
            outline[m, 1] = points[i, 1] + t * (points[i + 1, 1] - points[i, 1])
            m += 1
    return outline[:m].copy()


@njit(cache=True, nogil=True, inline="always")
def _is_across(normals, i, dx, dy):  # type: ignore[no-untyped-def]
    nx, ny = normals[i, 0], normals[i, 1]
    return (nx != 0.0 or ny != 0.0) and abs(nx * dx + ny * dy) < _MAX_ACROSS_COSINE


@njit(cache=True, nogil=True, inline="always")
def _distance(points, a, b):  # type: ignore[no-untyped-def]
    return math.hypot(points[a, 0] - points[b, 0], points[a, 1] - points[b, 1])
