"""Corners of a tag to a fraction of a pixel: lines fitted to the edges of its black square, and their intersections.

Wang & Olson: AprilTag 2: Efficient and robust fiducial detection, IROS 2016, section III-E.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.tags.brightness import brightness_at

SAMPLES = 32
"""Points of an edge at which its place is measured."""
REACH, STEP = 2.5, 0.25
"""Distance from the edge that is searched, and between two places, pixels."""
REACH_SHARE = 0.08
"""The same as a share of the side of small tags, whose squares are an eighth of it or wider."""
CORNER_SHARE = 0.05
"""Share of an edge at each end that is left out: the image of a corner is round."""
MIN_WEIGHT = 20.0
"""Sum of the gradients along a search, grey levels, below which there is no edge."""
MAX_SHIFT = 3.0
"""Distance by which a corner may move, pixels; one that moves farther is kept, as its lines are nearly parallel."""


def refined_corners(grey: NDArray[np.uint8], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners (4, 2) of a dark square on a bright ground, pixels; the first pixel's centre is (0, 0).

    corners: their estimates, in either order around the square. An edge that is not found keeps its estimate.
    """
    centre = corners.mean(axis=0)
    ends = np.roll(corners, -1, axis=0)
    lines = [_edge_line(grey, *edge, centre) for edge in zip(corners, ends, strict=True)]
    return np.array([_corner(lines[i - 1], lines[i], corners[i]) for i in range(4)])


def _edge_line(
    grey: NDArray[np.uint8], start: NDArray[np.float64], end: NDArray[np.float64], centre: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a point of an edge and its direction."""
    along = end - start
    length = float(np.hypot(*along))
    normal = np.array([along[1], -along[0]]) / max(length, 1e-9)
    if normal @ (0.5 * (start + end) - centre) < 0.0:
        normal = -normal
    shares = np.linspace(CORNER_SHARE, 1.0 - CORNER_SHARE, SAMPLES)
    points = start + shares[:, np.newaxis] * along
    reach = min(REACH, REACH_SHARE * length)
    offsets = np.arange(-reach, reach + STEP / 2.0, STEP)
    # Gradient outwards at each place: central difference of one pixel; only from dark to bright.
    outer, inner = (_brightness(grey, points, normal, offsets + half) for half in (0.5, -0.5))
    weights = np.maximum(outer - inner, 0.0)
    total = weights.sum(axis=1)
    found = total > MIN_WEIGHT
    if np.count_nonzero(found) < SAMPLES // 2:
        return start, along
    shift = (weights[found] @ offsets) / total[found]
    # Total least squares: the direction of the greatest extent.
    on_edge = points[found] + shift[:, np.newaxis] * normal
    mean = on_edge.mean(axis=0)
    direction: NDArray[np.float64] = np.linalg.svd(on_edge - mean)[2][0]
    return mean, direction


def _brightness(
    grey: NDArray[np.uint8],
    points: NDArray[np.float64],
    normal: NDArray[np.float64],
    offsets: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the brightness (n, m), interpolated, at points (n, 2) moved along the normal by offsets (m,)."""
    places = points[:, np.newaxis, :] + offsets[np.newaxis, :, np.newaxis] * normal
    return brightness_at(grey, places[..., 0].ravel(), places[..., 1].ravel()).reshape(places.shape[:2])


def _corner(
    one: tuple[NDArray[np.float64], NDArray[np.float64]],
    other: tuple[NDArray[np.float64], NDArray[np.float64]],
    estimate: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the intersection of two lines, or the estimate if it is far from it."""
    (p, d), (q, e) = one, other
    cross = float(d[0] * e[1] - d[1] * e[0])
    if abs(cross) < 1e-9:
        return estimate
    offset = q - p
    corner: NDArray[np.float64] = p + float(offset[0] * e[1] - offset[1] * e[0]) / cross * d
    return corner if float(np.hypot(*(corner - estimate))) <= MAX_SHIFT else estimate
