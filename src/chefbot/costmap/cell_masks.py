"""Which cells of a costmap lie in a disc or in a polygon."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.update_window import CellWindow
from chefbot.maths.polygon import GridGeometry
from chefbot.maths.se2 import SE2


def disc_mask(
    grid: GridGeometry, pose: SE2, radius: float, window: CellWindow | None = None
) -> NDArray[np.bool_]:
    """Return which cells of the window, or of all, have their centre within `radius` metres of the pose."""
    x, y = _centres(grid, pose, window)
    return x[None, :] ** 2 + y[:, None] ** 2 <= radius * radius


def discs_mask(grid: GridGeometry, poses: Sequence[SE2], radius: float) -> NDArray[np.bool_]:
    """Return which cells (h, w) have their centre within `radius` metres of one of the poses."""
    mask = np.zeros((grid.height, grid.width), np.bool_)
    for pose in poses:
        column, row = (pose.x - grid.origin_x) / grid.resolution, (pose.y - grid.origin_y) / grid.resolution
        window = CellWindow.around(row, column, radius / grid.resolution).expanded(0, mask.shape)
        if not window.empty:
            mask[window.slices] |= disc_mask(grid, pose, radius, window)
    return mask


def polygon_mask(
    grid: GridGeometry, pose: SE2, corners: NDArray[np.float64], margin: float, window: CellWindow
) -> NDArray[np.bool_]:
    """Return which cells of the window have their centre inside a convex polygon, `margin` metres from its edges.

    corners: (n, 2), m, counter-clockwise, in the frame of the pose.
    """
    x, y = _centres(grid, pose, window)
    inside = np.ones((len(y), len(x)), np.bool_)
    turned = SE2(0.0, 0.0, pose.yaw).apply(corners)
    for (ax, ay), (bx, by) in zip(turned, np.roll(turned, -1, axis=0), strict=True):
        # distance to the left of the edge, counter-clockwise
        left = (bx - ax) * (y[:, None] - ay) - (by - ay) * (x[None, :] - ax)
        inside &= left >= margin * math.hypot(bx - ax, by - ay)
    return inside


def _centres(
    grid: GridGeometry, pose: SE2, window: CellWindow | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x (w,) and y (h,) of the centres of columns and rows from the pose, m, along the axes of the grid."""
    rows, columns = window.slices if window is not None else (slice(None), slice(None))
    x = grid.origin_x + (np.arange(grid.width, dtype=np.float64)[columns] + 0.5) * grid.resolution - pose.x
    y = grid.origin_y + (np.arange(grid.height, dtype=np.float64)[rows] + 0.5) * grid.resolution - pose.y
    return x, y
