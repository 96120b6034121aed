"""From a scan to the points that are matched and the rays that are drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2


@dataclass(frozen=True, eq=False)
class Beams:
    """A scan seen from the robot, in metres.

    sensor: (2,) where the beams start. ends: (n, 2) float32 where they hit or are no longer used.
    hit: (n,) whether there is a surface at the end.
    """

    sensor: NDArray[np.float32]
    ends: NDArray[np.float32]
    hit: NDArray[np.bool_]

    @property
    def surfaces(self) -> NDArray[np.float32]:
        """Ends on a surface, (m, 2)."""
        return self.ends[self.hit]


def beams_of(
    angles: NDArray[np.float32],
    ranges: NDArray[np.float32],
    sensor: SE2,
    max_range: float,
    clear_range: float,
) -> Beams:
    """The useful beams of a scan: angles (n,) rad in the sensor's frame, ranges (n,) m.

    REP-117: +inf means nothing was in reach, so the beam is free up to `clear_range`; NaN, -inf and ranges
    not above 0 are no measurements and are left out. A return beyond `max_range` is free up to there.
    """
    ranges = np.asarray(ranges, np.float64)
    valid = ranges > 0.0
    ranges = ranges[valid]
    directions = np.asarray(angles, np.float64)[valid] + sensor.yaw
    hit = ranges <= max_range
    length = np.where(hit, ranges, np.where(np.isinf(ranges), min(clear_range, max_range), max_range))
    start = np.array([sensor.x, sensor.y])
    ends = start + length[:, None] * np.column_stack([np.cos(directions), np.sin(directions)])
    return Beams(start.astype(np.float32), ends.astype(np.float32), hit)


@njit(cache=True, nogil=True)
def thinned(points, spacing):  # type: ignore[no-untyped-def]
    """Of neighbouring points (n, 2) closer together than `spacing` only the first.

    A camera's 640 beams fall within millimetres of each other on a near wall: no news, but time, and
    the near wall would outvote the far one.
    """
    kept = np.empty_like(points)
    n = 0
    for i in range(len(points)):
        if n > 0:
            dx, dy = points[i, 0] - kept[n - 1, 0], points[i, 1] - kept[n - 1, 1]
            if dx * dx + dy * dy < spacing * spacing:
                continue
        kept[n, 0], kept[n, 1] = points[i, 0], points[i, 1]
        n += 1
    return kept[:n].copy()


def reach(beams: Beams) -> float:
    """Metres from the robot to the furthest end of a beam, or to the sensor."""
    far = np.hypot(beams.ends[:, 0], beams.ends[:, 1]).max() if len(beams.ends) else 0.0
    return max(float(far), math.hypot(*beams.sensor))
