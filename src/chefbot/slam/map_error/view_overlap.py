"""What two keyframes see in common: do the surfaces of one lie where the other sees them?"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.slam.map_error.keyframes import BINS, REACH, Floats, Keyframes

MAX_DISTANCE = 8.0
"""Distance up to which two keyframes are compared, m."""
OTHER_PASS_TRAVEL = 5.0
"""Travel from which a keyframe belongs to another pass, m: closer ones share the error of the mapper."""
MIN_COSINE = 0.3
"""Of the angle of incidence; the distance of a grazed wall is uncertain."""
MAX_OFFSET = 0.5
"""Distance up to which both see one surface, m. Beyond it, a nearer return hides it and a farther one denies it."""
MIN_RANGE = 0.1
SEEN, DENIED, SQUARES = 0, 1, 2
"""Columns of the counts."""


class Overlaps(NamedTuple):
    """Pairs of keyframes and what they have in common.

    pairs: (m, 2) indices; the points of the first are compared with the view of the second. following: (m,) whether
    the second is the next one on the same drive; all others are of another pass. counts: (m, 3) number of points that
    the second sees where they are, of those that it sees through, and sum of the squared distances between the
    surfaces, m^2. information: (m, 6, 6) of both poses, for points on lines with a standard deviation of 1 m.
    by_point: (n, POINTS, 3) the counts of each point by keyframes of other passes.
    """

    pairs: NDArray[np.int64]
    following: NDArray[np.bool_]
    counts: Floats
    information: Floats
    by_point: Floats


def overlaps_of(frames: Keyframes) -> Overlaps:
    """Compare each keyframe with the next one, and with those of other passes that are near."""
    pairs = _pairs(frames)
    following = (pairs[:, 1] == pairs[:, 0] + 1) & (frames.drive[pairs[:, 0]] == frames.drive[pairs[:, 1]])
    counts, information, by_point = _compare(
        pairs,
        following,
        frames.poses,
        frames.sensors,
        frames.views,
        frames.points,
        frames.normals,
        frames.counts,
    )
    return Overlaps(pairs, following, counts, information, by_point)


def _pairs(frames: Keyframes) -> NDArray[np.int64]:
    n, path = len(frames), frames.poses[:, :2]
    distance = np.hypot(*(path[:, None] - path[None]).transpose(2, 0, 1))
    other = np.abs(frames.travel[:, None] - frames.travel[None]) >= OTHER_PASS_TRAVEL
    other |= frames.drive[:, None] != frames.drive[None]
    wanted = other & (distance <= MAX_DISTANCE)
    wanted[np.arange(n - 1), np.arange(1, n)] = True
    pairs: NDArray[np.int64] = np.argwhere(wanted)
    return pairs


@njit(cache=True, nogil=True)
def _compare(pairs, following, poses, sensors, views, points, normals, numbers):  # type: ignore[no-untyped-def]
    """Return counts (m, 3), information (m, 6, 6) and counts by point (n, POINTS, 3), as in Overlaps."""
    counts, information = np.zeros((len(pairs), 3)), np.zeros((len(pairs), 6, 6))
    by_point, row = np.zeros((len(points), points.shape[1], 3)), np.zeros(6)
    for m in range(len(pairs)):
        i, j = pairs[m]
        for t in range(numbers[i]):
            x, y, nx, ny = points[i, t, 0], points[i, t, 1], normals[i, t, 0], normals[i, t, 1]
            # The point from the other sensor
            dx, dy = x - sensors[j, 0], y - sensors[j, 1]
            distance = math.hypot(dx, dy)
            if distance > REACH or distance < MIN_RANGE:
                continue
            cosine = -(dx * nx + dy * ny) / distance
            if cosine < MIN_COSINE:
                continue
            offset = _range_offset(views[j], math.atan2(dy, dx) - sensors[j, 2], distance)
            if math.isnan(offset) or offset < -MAX_OFFSET:
                continue
            # Seen there, or seen through; the distance between the surfaces is that along the normal
            kind = SEEN if offset <= MAX_OFFSET else DENIED
            square = (offset * cosine) ** 2 if kind == SEEN else 0.0
            counts[m, kind] += 1.0
            counts[m, SQUARES] += square
            if not following[m]:
                by_point[i, t, kind] += 1.0
                by_point[i, t, SQUARES] += square
            if kind == DENIED:
                continue
            # Jacobian of the distance with respect to both poses: n and p x n
            row[0], row[1], row[2] = nx, ny, (x - poses[i, 0]) * ny - (y - poses[i, 1]) * nx
            row[3], row[4], row[5] = -nx, -ny, (y - poses[j, 1]) * nx - (x - poses[j, 0]) * ny
            for u in range(6):
                for v in range(6):
                    information[m, u, v] += row[u] * row[v]
    return counts, information, by_point


@njit(cache=True, nogil=True)
def _range_offset(view, bearing, distance):  # type: ignore[no-untyped-def]
    """Return by how much the nearest of three neighbouring ranges is longer than `distance`, m; NaN without any."""
    middle = math.floor((bearing + math.pi) / (2.0 * math.pi) * BINS)
    offset = math.nan
    for bin_number in range(middle - 1, middle + 2):
        difference = view[bin_number % BINS] - distance
        if not math.isnan(difference) and (math.isnan(offset) or abs(difference) < abs(offset)):
            offset = difference
    return offset
