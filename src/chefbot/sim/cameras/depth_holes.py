"""Holes of the floor in a depth image: pixels that see the floor there see the hole's bottom or its sides instead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.buildings.world_file import FloorHole
from chefbot.sim.cameras.depth_raycast import FLOOR, Depths, Floats, Numbers


def hole_array(holes: Sequence[FloorHole]) -> NDArray[np.float64]:
    """Return the holes as rows (n, 5): x0, y0, x1, y1 and depth, m."""
    rows = [
        (h.x - h.size[0] / 2, h.y - h.size[1] / 2, h.x + h.size[0] / 2, h.y + h.size[1] / 2, h.depth)
        for h in holes
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


@njit(cache=True, nogil=True, error_model="numpy")
def draw_holes(
    holes: Floats, position: Floats, rotation: Floats, focal: float, depth: Depths, number: Numbers
) -> None:
    """Increase the depth of pixels of the floor that lie over a hole; holes (n, 5), the others as in `draw`."""
    rows, columns = depth.shape
    ray = np.empty(3)
    for v in range(rows):
        for u in range(columns):
            if number[v, u] != FLOOR:
                continue
            # ray of the pixel in the world, scaled to depth 1 along the optical axis
            x, y = (u - 0.5 * (columns - 1)) / focal, (v - 0.5 * (rows - 1)) / focal
            for j in range(3):
                ray[j] = rotation[j, 0] * x + rotation[j, 1] * y + rotation[j, 2]
            for i in range(len(holes)):
                t = _depth_in_hole(holes[i], position, ray, depth[v, u])
                if t > depth[v, u]:
                    depth[v, u] = t


@njit(cache=True, nogil=True, error_model="numpy")
def _depth_in_hole(hole: Floats, position: Floats, ray: Floats, entry: float) -> float:
    """Return the depth at which a ray that meets the floor at depth `entry` leaves the hole, 0 if it is beside it."""
    leave = np.inf
    for axis in range(2):
        at = position[axis] + entry * ray[axis]
        low, high = hole[axis], hole[axis + 2]
        if not low < at < high:
            return 0.0
        # slab method: the side that the ray moves towards
        if ray[axis] != 0.0:
            side = high if ray[axis] > 0.0 else low
            leave = min(leave, (side - position[axis]) / ray[axis])
    # bottom of the hole: z(t) = p_z + t r_z = -depth
    return min(leave, (-hole[4] - position[2]) / ray[2])
