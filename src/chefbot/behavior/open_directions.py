"""How far a robot can drive straight on in each direction, by the scans from one place."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.angles import wrap

DIRECTIONS = 72
"""Number of directions that are compared: one every 5 degrees."""
CLEARANCE = 0.08
"""Distance that is kept on both sides and ahead, m: half of what a doorway of 0.8 m leaves a robot of 0.5 m."""
MAX_LEG_LENGTH = 4.0
"""Longest way, m."""
REVISIT_DISCOUNT_DISTANCE = 0.1
"""Distance by which a visited place counts as farther away with each one visited after it, m."""
STEPS = 9
"""Number of places that are compared along a way."""
GOOD_SHARE = 0.95
"""Share of the best worth from which on a direction is as good."""
Floats = NDArray[np.float64]


class OpenWay(NamedTuple):
    """A heading in odom, rad, and how far to drive along it, m."""

    heading: float
    length: float


class OpenDirections:
    """The free length in each direction of the odom frame. radius: of the circle around the robot, m."""

    def __init__(self, radius: float) -> None:
        self._radius = radius
        self._headings = 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
        self.clear()

    def clear(self) -> None:
        """Drop what was seen from another place."""
        self._lengths = np.zeros(DIRECTIONS)

    def process(self, bearings: Floats, ranges: Floats, range_max: float, yaw: float) -> None:
        """Take a scan: bearings (n,), rad, and ranges (n,), m, in base_link, whose yaw in odom is given.

        A range of inf is free up to range_max; a direction with NaN on its way is not known.
        """
        known = ~np.isnan(ranges)
        if not known.any():
            return
        seen = self._in_view(bearings[known], yaw)
        reach = min(range_max, MAX_LEG_LENGTH + self._radius + CLEARANCE)
        ends = np.minimum(ranges[known], reach)
        headings = bearings[known] + yaw
        # across and along each direction (d, n) of the ends of the beams
        turned = headings[None, :] - self._headings[seen, None]
        along, across = ends * np.cos(turned), ends * np.sin(turned)
        blocks = (np.abs(across) < self._radius + CLEARANCE) & (along > 0.0) & (ends < reach)
        lengths = np.where(blocks, along, np.inf).min(axis=1, initial=reach)
        self._lengths[seen] = np.clip(lengths - self._radius - CLEARANCE, 0.0, MAX_LEG_LENGTH)

    def _in_view(self, bearings: Floats, yaw: float) -> NDArray[np.int64]:
        """Return the directions (d,) with a known beam near them."""
        step = 2.0 * math.pi / DIRECTIONS
        nearest = np.round((bearings + yaw) / step).astype(np.int64) % DIRECTIONS
        return np.unique(nearest)

    def best(self, position: Floats, visited: Floats) -> OpenWay:
        """Return the way from a position (2,) to the place that is farthest from those visited (k, 2), in odom, m.

        The longer ago a place was visited, the more it is worth to see it again, as at the end of a corridor.
        """
        steps = np.linspace(0.0, 1.0, STEPS)
        beams = np.column_stack([np.cos(self._headings), np.sin(self._headings)])
        lengths = self._lengths[:, None] * steps  # (d, s)
        places = position + lengths[:, :, None] * beams[:, None, :]
        age = REVISIT_DISCOUNT_DISTANCE * np.arange(len(visited))[::-1]
        apart = (np.linalg.norm(places[:, :, None, :] - visited, axis=3) + age).min(axis=2)
        worth = apart.max(axis=1)
        middle = _middle_of_best(worth)
        return OpenWay(wrap(float(self._headings[middle])), float(lengths[middle, apart[middle].argmax()]))


def _middle_of_best(worth: Floats) -> int:
    """Return the middle of the directions around the best one that are nearly as good, as through a doorway."""
    n, best = len(worth), int(worth.argmax())
    good = worth >= GOOD_SHARE * worth[best]
    last = next((k for k in range(n) if not good[(best + k + 1) % n]), n - 1)
    first = next((k for k in range(n - last) if not good[(best - k - 1) % n]), 0)
    return (best + (last - first) // 2) % n
