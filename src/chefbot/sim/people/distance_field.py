"""Distance to the nearest obstacle at a person's height, on a grid over the floor.

The grid's frame is an array (3,): x and y of the lower left corner and the side of a cell, m. Values belong to the
centres of the cells.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Field = NDArray[np.float32]


@njit(cache=True, nogil=True)
def lower_to_boxes(field: Field, frame: Floats, boxes: Floats, reach: float) -> None:
    """Lower the field within `reach` metres of the boxes to the distance to them, 0 inside.

    boxes: (n, 7), x, y, half sides along the own axes, cosine and sine of the yaw, radius of rounding.
    """
    h, w = field.shape
    for n in range(boxes.shape[0]):
        x, y, hx, hy, c, s, radius = boxes[n]
        # Window of cells around the box.
        ex = abs(c) * hx + abs(s) * hy + radius + reach
        ey = abs(s) * hx + abs(c) * hy + radius + reach
        c0, c1 = int((x - ex - frame[0]) / frame[2]), int((x + ex - frame[0]) / frame[2]) + 1
        r0, r1 = int((y - ey - frame[1]) / frame[2]), int((y + ey - frame[1]) / frame[2]) + 1
        for row in range(max(r0, 0), min(r1, h)):
            for column in range(max(c0, 0), min(c1, w)):
                dx = frame[0] + (column + 0.5) * frame[2] - x
                dy = frame[1] + (row + 0.5) * frame[2] - y
                # Distance beyond each pair of sides, in the frame of the box.
                ox = max(abs(c * dx + s * dy) - hx, 0.0)
                oy = max(abs(c * dy - s * dx) - hy, 0.0)
                distance = max(math.sqrt(ox * ox + oy * oy) - radius, 0.0)
                field[row, column] = min(field[row, column], np.float32(distance))


@njit(cache=True, nogil=True)
def distance_at(field: Field, frame: Floats, x: float, y: float) -> float:
    """Return the distance to the nearest obstacle by bilinear interpolation, m; 0 outside the grid."""
    across, up = (x - frame[0]) / frame[2] - 0.5, (y - frame[1]) / frame[2] - 0.5
    if not (0.0 <= across < field.shape[1] - 1 and 0.0 <= up < field.shape[0] - 1):
        return 0.0
    column, row = int(across), int(up)
    a, b = across - column, up - row
    low = (1.0 - a) * field[row, column] + a * field[row, column + 1]
    high = (1.0 - a) * field[row + 1, column] + a * field[row + 1, column + 1]
    return (1.0 - b) * low + b * high


@njit(cache=True, nogil=True)
def away_from_obstacle(field: Field, frame: Floats, x: float, y: float) -> tuple[float, float]:
    """Return the unit vector in which the distance grows most; (0, 0) where there is none."""
    h = frame[2]
    gx = distance_at(field, frame, x + h, y) - distance_at(field, frame, x - h, y)
    gy = distance_at(field, frame, x, y + h) - distance_at(field, frame, x, y - h)
    length = math.sqrt(gx * gx + gy * gy)
    if length < 1e-6:
        return 0.0, 0.0
    return gx / length, gy / length


@njit(cache=True, nogil=True)
def line_is_clear(
    field: Field, frame: Floats, x0: float, y0: float, x1: float, y1: float, margin: float
) -> bool:
    """Return whether a straight line keeps `margin` metres to all obstacles (sphere tracing, Hart 1996).

    From a start that is nearer than that, it keeps what the start has.
    """
    dx, dy = x1 - x0, y1 - y0
    length = math.sqrt(dx * dx + dy * dy)
    along = 0.0
    margin = min(margin, distance_at(field, frame, x0, y0) - 1e-3)
    while along < length:
        t = along / length
        free = distance_at(field, frame, x0 + t * dx, y0 + t * dy)
        if free < margin or free <= 0.0:
            return False
        along += max(free - margin, frame[2])
    return distance_at(field, frame, x1, y1) >= margin


@njit(cache=True, nogil=True)
def is_visible(field: Field, frame: Floats, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Return whether nothing stands between two points of the grid, by the cells' values without interpolation."""
    dx, dy = x1 - x0, y1 - y0
    length, cell = math.sqrt(dx * dx + dy * dy), frame[2]
    along, height, width = 0.0, field.shape[0], field.shape[1]
    while along < length:
        t = along / length
        column, row = int((x0 + t * dx - frame[0]) / cell), int((y0 + t * dy - frame[1]) / cell)
        if not (0 <= row < height and 0 <= column < width) or field[row, column] < 0.5 * cell:
            return False
        along += max(field[row, column], cell)
    return True


@njit(cache=True, nogil=True)
def free_range(field: Field, frame: Floats, x: float, y: float, ux: float, uy: float, limit: float) -> float:
    """Return how far the ray from (x, y) along the unit vector (ux, uy) gets, at most `limit` metres."""
    along = 0.0
    while along < limit:
        free = distance_at(field, frame, x + along * ux, y + along * uy)
        if free < 0.5 * frame[2]:
            return along
        along += max(free, 0.5 * frame[2])
    return limit
