"""Ranges at which a lidar sees its own robot: what lies within the footprint is no obstacle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.footprint import Footprint
from chefbot.robot.sensors import Lidar

MARGIN = 0.02
"""Distance beyond the footprint that still counts as the robot, m: noise of the lidar and errors of its mount."""
Floats = NDArray[np.float64]


class OwnBody:
    """The footprint as a lidar sees it: the distances at which each beam of its scan enters and leaves it."""

    def __init__(self, lidar: Lidar, footprint: Footprint) -> None:
        bearings = lidar.angle_min + lidar.angle_increment * np.arange(lidar.beams) + lidar.mount.yaw
        beams = np.column_stack([np.cos(bearings), np.sin(bearings)])
        mount = np.array([lidar.mount.x, lidar.mount.y])
        if footprint.corners:
            self._enters, self._leaves = _through_polygon(mount, beams, footprint.polygon(MARGIN))
        else:
            self._enters, self._leaves = _through_disc(mount, beams, footprint.circumscribed_radius + MARGIN)

    def without(self, ranges: NDArray[np.floating], range_min: float) -> NDArray[np.floating]:
        """Return ranges (n,), m, with NaN for those from `range_min` on that end within the robot."""
        own = (ranges >= max(range_min, 0.0)) & (ranges >= self._enters) & (ranges <= self._leaves)
        return np.where(own, ranges.dtype.type(math.nan), ranges) if own.any() else ranges


def _through_disc(mount: Floats, beams: Floats, radius: float) -> tuple[Floats, Floats]:
    """Return where lines (n, 2) from a point cross a disc about the origin, m; inf and -inf where they miss it.

    The roots of |mount + t beam|^2 = radius^2.
    """
    along = beams @ mount
    square = along**2 - mount @ mount + radius**2
    root = np.sqrt(np.maximum(square, 0.0))
    missed = square < 0.0
    return np.where(missed, np.inf, -along - root), np.where(missed, -np.inf, root - along)


def _through_polygon(mount: Floats, beams: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Return the same for a convex polygon (k, 2), counter-clockwise, whose sides cut the line (Cyrus, Beck 1978)."""
    sides = np.roll(corners, -1, axis=0) - corners
    outwards = np.column_stack([sides[:, 1], -sides[:, 0]])
    height = np.sum(
        outwards * (corners - mount), axis=1
    )  # (k,): of a side over the mount, in outward normals
    rate = beams @ outwards.T  # (n, k)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        cuts = height / rate
    enters = np.where(rate < 0.0, cuts, -np.inf).max(axis=1)
    leaves = np.where(rate > 0.0, cuts, np.inf).min(axis=1)
    missed = (enters > leaves) | ((rate == 0.0) & (height < 0.0)).any(axis=1)
    return np.where(missed, np.inf, enters), np.where(missed, -np.inf, leaves)
