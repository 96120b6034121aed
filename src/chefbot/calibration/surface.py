"""The scanned walls of one station, as points with locally fitted lines.

The uncertainty of a line's direction matters as much as the direction: the depth of a camera is noisy, and
walls with noisy normals seem to constrain a scan along themselves.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
END = 0.01
"""Standard deviation of the end of a beam about its wall, m."""
NEIGHBOURHOOD_RADII = (0.12, 0.24, 0.48, 0.96)
"""Radii of the neighbourhoods of a point, m; the widest one that is still straight gives the direction."""
MIN_NEIGHBOURS = 4
MAX_ASPECT = 0.15
"""Ratio of width to length above which the smallest neighbourhood, if wider than the noise, is a corner."""
MAX_WIDENING = 1.3
"""Maximum ratio of a neighbourhood's width to that of the smallest one; bends and steps exceed it by far."""


class _Lines(NamedTuple):
    """Fitted lines around n points: number of neighbours (n,), their mean and line normal (n, 2), and
    standard deviations across (width) and along (length) the line (n,), m."""

    neighbours: Array
    middle: Array
    normal: Array
    width: Array
    length: Array

    @property
    def tilt(self) -> Array:
        """Variance of the slope of the fitted line, rad^2, (n,)."""
        return (self.width / np.maximum(self.length, 1e-6)) ** 2 / self.neighbours


def _fit_lines(walls: Array, near: NDArray[np.bool_]) -> _Lines:
    """Fit lines by principal axes; `near` (n, n) marks the neighbours of each point."""
    # Mean and covariance of each neighbourhood
    weight = near.astype(np.float64)
    count = weight.sum(axis=1)
    middle = weight @ walls / count[:, None]
    xx, yy = (weight @ walls[:, k] ** 2 / count - middle[:, k] ** 2 for k in (0, 1))
    xy = weight @ (walls[:, 0] * walls[:, 1]) / count - middle[:, 0] * middle[:, 1]
    # Eigenvalues mean +- radius and major axis of the 2 x 2 covariance
    direction = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    mean, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    normal = np.column_stack([-np.sin(direction), np.cos(direction)])
    return _Lines(count, middle, normal, np.sqrt(np.maximum(mean - radius, 0.0)), np.sqrt(mean + radius))


class Surface:
    """The scanned points (n, 2) m of one station, in the sensor frame, with locally fitted lines.

    walls: points as scanned. points: smoothed, for the nearest-neighbour search. middles, normals (n, 2): a
    point on each line and its normal. tilts (n,): variance of the line's direction, rad^2. flat (n,): whether
    the line is straight beyond the smallest neighbourhood; corners, bends and round objects bias a match,
    because two scans see different parts of them.
    """

    def __init__(self, walls: Array) -> None:
        distances = np.hypot(*(walls[:, None] - walls[None]).transpose(2, 0, 1))
        # Line of the smallest neighbourhood
        smallest = _fit_lines(walls, distances < NEIGHBOURHOOD_RADII[0])
        self.walls, self.points = walls, smallest.middle
        self.middles, self.normals, self.tilts = smallest.middle.copy(), smallest.normal, smallest.tilt
        self.flat = np.zeros(len(walls), np.bool_)
        alone = smallest.neighbours < MIN_NEIGHBOURS
        straight = smallest.width < MAX_ASPECT * smallest.length + END
        # Widen the neighbourhood while it stays straight
        for radius in NEIGHBOURHOOD_RADII[1:]:
            wider = _fit_lines(walls, distances < radius)
            straight = (straight | alone) & (wider.width < np.maximum(MAX_WIDENING * smallest.width, END))
            alone &= wider.neighbours < MIN_NEIGHBOURS
            straight &= ~alone
            self.flat |= straight
            self.middles[straight] = wider.middle[straight]
            self.normals[straight] = wider.normal[straight]
            self.tilts[straight] = wider.tilt[straight]

    @cached_property
    def tree(self) -> Any:
        """K-d tree of the smoothed points for the nearest-neighbour search."""
        from scipy.spatial import cKDTree

        return cKDTree(self.points)
