"""Geometric check of a closure: surfaces of one submap must not lie in the free space of the other."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.slam.graph.surface_grid import CELL, transformed

_SURFACE_MARGIN = 0.3
"""Part of a ray before its end that is not counted as free, m."""
_MAX_RAY = 20.0
"""Part of a ray that is drawn, m."""
_EXPLAINED_VALUE, _FAR_VALUE = 60, 8
"""Field values from which a point lies on a known surface, and below which none is near."""


def mark_free(free: NDArray[np.uint8], origin: NDArray[np.float64], sensor: NDArray[np.float32],
              ends: NDArray[np.float32], pose: NDArray[np.float64]) -> None:  # fmt: skip
    """Mark the cells of `free` that the rays from `sensor` (2,) to `ends` (n, 2), m, cross at `pose` (3,)."""
    placed = transformed(np.vstack([sensor[None], ends]), pose)
    _draw(placed[0], placed[1:], origin, free)


@njit(cache=True, nogil=True)
def _draw(sensor, ends, origin, free):  # type: ignore[no-untyped-def]
    height, width = free.shape
    x0, y0 = (sensor[0] - origin[0]) / CELL, (sensor[1] - origin[1]) / CELL
    for i in range(len(ends)):
        dx, dy = (ends[i, 0] - origin[0]) / CELL - x0, (ends[i, 1] - origin[1]) / CELL - y0
        length = math.hypot(dx, dy)
        stop = min(length - _SURFACE_MARGIN / CELL, _MAX_RAY / CELL)
        for k in range(int(max(stop, 0.0))):
            column, row = math.floor(x0 + dx * k / length), math.floor(y0 + dy * k / length)
            if column >= 0 and row >= 0 and column < width and row < height:
                free[int(row), int(column)] = 1


@njit(cache=True, nogil=True)
def count_explained(points, pose, field, free, origin):  # type: ignore[no-untyped-def]
    """Return how many points (n, 2) at `pose` (3,) lie on known surfaces, and how many in free space."""
    height, width = field.shape
    c, s = math.cos(pose[2]), math.sin(pose[2])
    explained, contradicted = 0, 0
    for i in range(len(points)):
        u = (c * points[i, 0] - s * points[i, 1] + pose[0] - origin[0]) / CELL
        v = (s * points[i, 0] + c * points[i, 1] + pose[1] - origin[1]) / CELL
        if not (u >= 0.0 and v >= 0.0 and u < width and v < height):
            continue
        value = field[int(v), int(u)]
        if value >= _EXPLAINED_VALUE:
            explained += 1
        elif value < _FAR_VALUE and free[int(v), int(u)]:
            contradicted += 1
    return explained, contradicted
