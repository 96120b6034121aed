"""Conversion of a scan into end points for matching and rays for mapping."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2


@dataclass(frozen=True, eq=False)
class Beams:
    """A scan in the base frame, in metres.

    sensor: (2,) origin of the beams. ends: (n, 2) float32, ends of the beams. hit: (n,) whether the beam ends
    on a surface.
    """

    sensor: NDArray[np.float32]
    ends: NDArray[np.float32]
    hit: NDArray[np.bool_]

    @property
    def surfaces(self) -> NDArray[np.float32]:
        """End points on a surface, (m, 2)."""
        return self.ends[self.hit]


def beams_of(
    angles: NDArray[np.float32],
    ranges: NDArray[np.float32],
    sensor: SE2,
    max_range: float,
    clear_range: float,
) -> Beams:
    """Return the usable beams of a scan: angles (n,) rad in the sensor frame, ranges (n,) m.

    REP-117: +inf means no return, so the beam is free up to `clear_range`; NaN, -inf and ranges not above 0
    are invalid and left out. A return beyond `max_range` is free up to there.
    """
    ranges = np.asarray(ranges, np.float64)
    # Drop NaN, -inf and non-positive ranges
    valid = ranges > 0.0
    ranges = ranges[valid]
    directions = np.asarray(angles, np.float64)[valid] + sensor.yaw
    hit = ranges <= max_range
    # Length of the ray: the return, or the range that the beam clears
    length = np.where(hit, ranges, np.where(np.isinf(ranges), min(clear_range, max_range), max_range))
    start = np.array([sensor.x, sensor.y])
    ends = start + length[:, None] * np.column_stack([np.cos(directions), np.sin(directions)])
    return Beams(start.astype(np.float32), ends.astype(np.float32), hit)


@njit(cache=True, nogil=True)
def thinned(points, spacing):  # type: ignore[no-untyped-def]
    """Drop points (n, 2) that are closer than `spacing` to the last point kept.

    The 640 beams of a depth camera fall within millimetres of each other on a near wall: they carry no
    information but cost time, and the near wall would outweigh the far one.
    """
    kept = np.empty_like(points)
    n = 0
    for i in range(len(points)):
        if n > 0:
            dx, dy = points[i, 0] - kept[n - 1, 0], points[i, 1] - kept[n - 1, 1]
            # Skip points within `spacing` of the last point kept
            if dx * dx + dy * dy < spacing * spacing:
                continue
        kept[n, 0], kept[n, 1] = points[i, 0], points[i, 1]
        n += 1
    return kept[:n].copy()


def with_range_offset(beams: Beams, offset: float) -> Beams:
    """Return the beams with `offset` m added to the ranges of those that end on a surface."""
    if offset == 0.0 or not len(beams.ends):
        return beams
    rays = beams.ends - beams.sensor
    length = np.maximum(np.hypot(rays[:, 0], rays[:, 1]), np.float32(1e-6))
    # No beam is turned round
    stretch = np.where(beams.hit, np.maximum(1.0 + offset / length, 0.0), 1.0)
    return Beams(beams.sensor, (beams.sensor + rays * stretch[:, None]).astype(np.float32), beams.hit)


def reach(beams: Beams) -> float:
    """Return the distance in metres from the robot to the farthest end of a beam, or to the sensor."""
    max_range = np.hypot(beams.ends[:, 0], beams.ends[:, 1]).max() if len(beams.ends) else 0.0
    return max(float(max_range), math.hypot(*beams.sensor))
