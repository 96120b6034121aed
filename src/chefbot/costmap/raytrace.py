"""Marking and clearing along beams (Moravec & Elfes 1985, reduced to seen free, seen occupied, never
seen)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.costs import FREE, LETHAL

FRACTION_BITS = 20
FARTHEST = 1e9
"""Cells from the corner of the map; their product with any step stays within 64 bits."""


@njit(cache=True, nogil=True)
def _steps_inside(p: int, d: int, top: int, first: int, last: int) -> tuple[int, int]:
    """Of the steps k from `first` to before `last` those with 0 <= p + k d < top."""
    if d == 0:
        return (first, last) if 0 <= p < top else (first, first)
    if d > 0:
        return max(first, -(p // d)), min(last, -((p - top) // d))
    return max(first, (p - top) // -d + 1), min(last, p // -d + 1)


@njit(cache=True, nogil=True)
def _clear_line(
    cells: NDArray[np.uint8], also: NDArray[np.uint8], x0: float, y0: float, x1: float, y1: float
) -> None:
    """Write FREE into both layers from (x0, y0) up to but not into the cell of (x1, y1); coordinates in cells.

    A digital differential analyser in fixed point: one step along the longer axis per cell, and no step outside
    the map: a beam from far away costs no more than one within.
    """
    h, w = cells.shape
    # what is not finite, or so far away that fixed point cannot hold it, is no beam
    if not (max(abs(x0), abs(y0)) < FARTHEST and max(abs(x1), abs(y1)) < FARTHEST):
        return
    steps = int(max(abs(math.floor(x1) - math.floor(x0)), abs(math.floor(y1) - math.floor(y0))))
    if steps == 0:
        return
    # the start and the step of both axes
    one = 1 << FRACTION_BITS
    x, y = int(x0 * one), int(y0 * one)
    dx, dy = int((x1 - x0) / steps * one), int((y1 - y0) / steps * one)
    # the steps that lie within the map
    first, last = _steps_inside(x, dx, w * one, 0, steps)
    first, last = _steps_inside(y, dy, h * one, first, last)
    end_c, end_r = math.floor(x1), math.floor(y1)
    x += first * dx
    y += first * dy
    for _ in range(first, last):
        c, r = x >> FRACTION_BITS, y >> FRACTION_BITS
        if not (c == end_c and r == end_r):
            cells[r, c] = FREE
            also[r, c] = FREE
        x += dx
        y += dy


@njit(cache=True, nogil=True)
def mark_and_clear(
    cells: NDArray[np.uint8],
    resolution: float,
    origin_x: float,
    origin_y: float,
    sensor: NDArray[np.float64],
    angles: NDArray[np.float64],
    mark: NDArray[np.float64],
    clear_from: NDArray[np.float64],
    clear: NDArray[np.float64],
    also: NDArray[np.uint8],
) -> None:
    """Clear along every beam, then mark every return, so that no beam erases what its neighbour just saw.

    sensor: x, y, yaw in the map's frame. angles: (n,) radians in the sensor's frame. mark: (n,) metres to the
    obstacle, not finite for none. clear_from, clear: (n,) the metres between which it is known to be free,
    clear not above 0 for none. also: another layer, cleared along the beams but not marked; `cells` for none.
    """
    h, w = cells.shape
    x0, y0 = (sensor[0] - origin_x) / resolution, (sensor[1] - origin_y) / resolution
    for i in range(angles.shape[0]):
        if clear[i] > 0.0 and clear_from[i] < clear[i]:
            c, s = math.cos(sensor[2] + angles[i]) / resolution, math.sin(sensor[2] + angles[i]) / resolution
            near, far = clear_from[i], clear[i]
            _clear_line(cells, also, x0 + near * c, y0 + near * s, x0 + far * c, y0 + far * s)
    for i in range(angles.shape[0]):
        a, reach = sensor[2] + angles[i], mark[i] / resolution
        if math.isfinite(a) and math.isfinite(reach) and reach > 0.0:
            c = math.floor(x0 + reach * math.cos(a))
            r = math.floor(y0 + reach * math.sin(a))
            if 0 <= r < h and 0 <= c < w:
                cells[r, c] = LETHAL
