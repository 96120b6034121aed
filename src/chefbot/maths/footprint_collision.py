"""The collision check of a robot's footprint on the cells of a costmap.

As Nav2's FootprintCollisionChecker does, the edges of the polygon are followed over the cells: a pose collides if a
lethal cell lies on an edge. The inside needs no check, because a cell there would have touched an edge on its way in,
and near the middle it raises the cost of the robot's own cell to INSCRIBED.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

LETHAL_COST = 254
TOUCH_DISTANCE, MAX_DECREASE = 0.5, 0.02
"""Distance of the middle of a cell from a footprint that touches it, and by how much it may decrease, cells."""
SAMPLES_PER_CELL = 2.0
"""Points per cell along an edge; a corner of a cell that is missed is less than a quarter of a cell deep."""


@njit(cache=True, nogil=True)
def lethal_on_edges(
    cells: NDArray[np.uint8], x: float, y: float, yaw: float, corners: NDArray[np.float64]
) -> int:
    """Return the number of points on the edges of the footprint that lie in lethal cells.

    x, y and corners (n, 2) are in cells. Points outside the costmap count as free.
    """
    cos, sin, n, found = math.cos(yaw), math.sin(yaw), corners.shape[0], 0
    for i in range(n):
        # the edge in the frame of the costmap
        px, py = corners[i]
        qx, qy = corners[(i + 1) % n]
        ax, ay = x + cos * px - sin * py, y + sin * px + cos * py
        bx, by = x + cos * qx - sin * qy, y + sin * qx + cos * qy
        steps = max(1, math.ceil(math.hypot(bx - ax, by - ay) * SAMPLES_PER_CELL))
        for k in range(steps):
            row = math.floor(ay + (by - ay) * k / steps)
            column = math.floor(ax + (bx - ax) * k / steps)
            if 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]:
                found += cells[row, column] == LETHAL_COST
    return found


@njit(cache=True, nogil=True)
def lethal_distance(cells: NDArray[np.uint8], x: float, y: float, reach: float) -> float:
    """Return the distance in cells of a point from the nearest lethal cell, at most `reach`; 0 inside one."""
    nearest = reach * reach
    for row in range(max(math.floor(y - reach), 0), min(math.ceil(y + reach), cells.shape[0])):
        dy = max(row - y, y - row - 1, 0.0)
        for column in range(max(math.floor(x - reach), 0), min(math.ceil(x + reach), cells.shape[1])):
            if cells[row, column] == LETHAL_COST:
                dx = max(column - x, x - column - 1, 0.0)
                nearest = min(nearest, dx * dx + dy * dy)
    return math.sqrt(nearest)


@njit(cache=True, nogil=True)
def comes_nearer(cells: NDArray[np.uint8], poses: NDArray[np.float64], corners: NDArray[np.float64]) -> bool:
    """Return whether the footprint touches a lethal cell at a pose (n, 3) and is nearer to it than at the first one.

    A robot that touches something may move away from it, and along it. x, y and the corners (m, 2) of the convex
    footprint, counter-clockwise, are in cells. False for a disc, which has no corners.
    """
    if not len(corners):
        return False
    reach = TOUCH_DISTANCE
    for k in range(len(corners)):
        reach = max(reach, math.hypot(corners[k, 0], corners[k, 1]) + TOUCH_DISTANCE)
    # the window of the cells that any pose may touch
    top, bottom = poses[:, 1].min() - reach, poses[:, 1].max() + reach
    left, right = poses[:, 0].min() - reach, poses[:, 0].max() + reach
    for row in range(max(math.floor(top), 0), min(math.ceil(bottom), cells.shape[0])):
        for column in range(max(math.floor(left), 0), min(math.ceil(right), cells.shape[1])):
            if cells[row, column] != LETHAL_COST:
                continue
            before = _clearance(row, column, poses[0], corners)
            if before < -TOUCH_DISTANCE:
                continue  # no edge touches it: it is under the robot
            allowed = min(before, TOUCH_DISTANCE) - MAX_DECREASE
            for i in range(1, len(poses)):
                if _clearance(row, column, poses[i], corners) < allowed:
                    return True
    return False


@njit(cache=True, nogil=True)
def _clearance(row: int, column: int, pose: NDArray[np.float64], corners: NDArray[np.float64]) -> float:
    """Return the distance of the middle of a cell from a convex footprint, in cells, negative inside.

    Beside a corner it is the distance from the line of an edge, which is less.
    """
    x, y = column + 0.5 - pose[0], row + 0.5 - pose[1]
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    px, py = cos * x + sin * y, cos * y - sin * x
    largest, n = -math.inf, corners.shape[0]
    for i in range(n):
        ax, ay = corners[i]
        bx, by = corners[(i + 1) % n]
        length = math.hypot(bx - ax, by - ay)
        # to the right of an edge is outside
        largest = max(largest, ((by - ay) * (px - ax) - (bx - ax) * (py - ay)) / length)
    return largest
