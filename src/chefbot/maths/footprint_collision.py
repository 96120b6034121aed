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
TURN = 2.0 * math.pi
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
def lethal_while_rotating(
    cells: NDArray[np.uint8], x: float, y: float, yaw: float, angle: float, corners: NDArray[np.float64]
) -> int:
    """Return the largest number of `lethal_on_edges` while the robot rotates in place from `yaw` by `angle`, rad.

    Its farthest corner moves by at most half a cell between two checks. More than a turn is checked as one turn.
    """
    radius, largest = 0.0, 0
    angle = min(max(angle, -TURN), TURN)
    for i in range(corners.shape[0]):
        radius = max(radius, math.hypot(corners[i, 0], corners[i, 1]))
    steps = max(1, math.ceil(abs(angle) * radius * SAMPLES_PER_CELL))
    for k in range(1, steps + 1):
        largest = max(largest, lethal_on_edges(cells, x, y, yaw + angle * k / steps, corners))
    return largest
