"""The walls that one stand saw, as points with the line that each of them lies on.

How well a line's direction is known matters as much as the direction: the depth of a camera is noisy, and walls whose
normals waver look as if they held a scan along themselves.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
END = 0.01
"""m: standard deviation of a mean beam's end about its wall."""
RADII = (0.12, 0.24, 0.48, 0.96)
"""m about an end of a beam: its wall's direction is that of the widest neighbourhood that is still straight."""
LEAST_NEIGHBOURS = 4
THICK = 0.15
"""A smallest neighbourhood broader than this share of its length, and than the noise, is a corner, not a wall."""
STILL = 1.3
"""Times as broad as in the smallest neighbourhood a wider one may be: a bend or a step makes it far broader."""


class _Lines(NamedTuple):
    """About each of n points: how many are its neighbours (n,), their middle and their line's normal (n, 2), spread
    across and along it (n,), m."""

    neighbours: Array
    middle: Array
    normal: Array
    broad: Array
    long: Array

    @property
    def tilt(self) -> Array:
        """Variance of the direction, rad^2: that of a fitted line's slope."""
        return (self.broad / np.maximum(self.long, 1e-6)) ** 2 / self.neighbours


def _lines(walls: Array, near: NDArray[np.bool_]) -> _Lines:
    """Principal axes of the neighbours; `near` (n, n) tells whose they are."""
    weight = near.astype(np.float64)
    count = weight.sum(axis=1)
    middle = weight @ walls / count[:, None]
    xx, yy = (weight @ walls[:, k] ** 2 / count - middle[:, k] ** 2 for k in (0, 1))
    xy = weight @ (walls[:, 0] * walls[:, 1]) / count - middle[:, 0] * middle[:, 1]
    direction = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    mean, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    normal = np.column_stack([-np.sin(direction), np.cos(direction)])
    return _Lines(count, middle, normal, np.sqrt(np.maximum(mean - radius, 0.0)), np.sqrt(mean + radius))


class Surface:
    """Points (n, 2) m of one stand, in the sensor's frame, and the lines that they lie on.

    walls: as they were seen. points: smoothed, for finding neighbours. middles, normals (n, 2): a point on each line
    and its normal. tilts (n,): variance of the line's direction, rad^2. flat (n,): whether it is one, straight beyond
    the narrowest neighbourhood: corners, bends and round things push a match aside, for two scans see other parts.
    """

    def __init__(self, walls: Array) -> None:
        apart = np.hypot(*(walls[:, None] - walls[None]).transpose(2, 0, 1))
        least = _lines(walls, apart < RADII[0])
        self.walls, self.points = walls, least.middle
        self.middles, self.normals, self.tilts = least.middle.copy(), least.normal, least.tilt
        self.flat = np.zeros(len(walls), np.bool_)
        alone = least.neighbours < LEAST_NEIGHBOURS
        straight = least.broad < THICK * least.long + END
        for radius in RADII[1:]:
            wider = _lines(walls, apart < radius)
            straight = (straight | alone) & (wider.broad < np.maximum(STILL * least.broad, END))
            alone &= wider.neighbours < LEAST_NEIGHBOURS
            straight &= ~alone
            self.flat |= straight
            self.middles[straight] = wider.middle[straight]
            self.normals[straight] = wider.normal[straight]
            self.tilts[straight] = wider.tilt[straight]

    @cached_property
    def tree(self) -> Any:
        """For the nearest point."""
        from scipy.spatial import cKDTree

        return cKDTree(self.points)
