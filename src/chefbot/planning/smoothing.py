"""From a chain of cells to a path: pulled straight, evenly spaced, corners rounded, never dearer than
before."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

LONGEST_PULL = 200
"""Cells; bounds the time for one straight piece."""


@njit(cache=True, nogil=True)
def line_cost(
    weight: NDArray[np.float32],
    stride: int,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
) -> float:
    """Integral of the weight along a straight line, in cells; inf if it touches a blocked cell.

    Visits every cell that the line crosses (Amanatides & Woo 1987). weight: flat with a blocked rim;
    x, y in cells of that grid; both ends must be on it.
    """
    c, r = math.floor(x0), math.floor(y0)
    dx, dy = x1 - x0, y1 - y0
    length = math.hypot(dx, dy)
    step_c, step_r = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    delta_c = abs(1.0 / dx) if dx != 0.0 else math.inf
    delta_r = abs(1.0 / dy) if dy != 0.0 else math.inf
    next_c = ((c + 1 - x0) if dx > 0 else (x0 - c)) * delta_c if dx != 0.0 else math.inf
    next_r = ((r + 1 - y0) if dy > 0 else (y0 - r)) * delta_r if dy != 0.0 else math.inf
    t, total = 0.0, 0.0
    while True:
        w = weight[r * stride + c]
        if w == 0:
            return math.inf
        until = min(next_c, next_r, 1.0)
        total += (until - t) * length * w
        if until >= 1.0:
            return total
        t = until
        if next_c < next_r:
            c += step_c
            next_c += delta_c
        else:
            r += step_r
            next_r += delta_r


@njit(cache=True, nogil=True)
def pull(
    weight: NDArray[np.float32],
    stride: int,
    g: NDArray[np.float32],
    way: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Indices into `way` of the corners that remain when every straight line that is not dearer replaces
    its piece."""
    kept = [0]
    anchor = 0
    while anchor < way.shape[0] - 1:
        furthest = anchor + 1
        x0, y0 = way[anchor] % stride + 0.5, way[anchor] // stride + 0.5
        for j in range(anchor + 2, min(anchor + LONGEST_PULL, way.shape[0])):
            x1, y1 = way[j] % stride + 0.5, way[j] // stride + 0.5
            if line_cost(weight, stride, x0, y0, x1, y1) > (g[way[j]] - g[way[anchor]]) * 1.0001:
                break
            furthest = j
        anchor = furthest
        kept.append(anchor)
    return np.array(kept)


def resample(points: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Points (m, 2) along the polyline (n, 2), n >= 2, at most `spacing` apart; its corners stay."""
    pieces = [points[:1]]
    for a, b in pairwise(points):
        count = max(1, math.ceil(math.hypot(*(b - a)) / spacing - 1e-6))
        pieces.append(a + np.arange(1, count + 1)[:, None] / count * (b - a))
    return np.concatenate(pieces)


@njit(cache=True, nogil=True)
def relax(
    weight: NDArray[np.float32],
    stride: int,
    points: NDArray[np.float64],
    sweeps: int,
) -> None:
    """Move inner points (n, 2), in cells, towards the middle of their neighbours where that makes the path
    cheaper."""
    for _ in range(sweeps):
        for i in range(1, points.shape[0] - 1):
            ax, ay, x, y = points[i - 1, 0], points[i - 1, 1], points[i, 0], points[i, 1]
            bx, by = points[i + 1, 0], points[i + 1, 1]
            nx, ny = 0.5 * x + 0.25 * (ax + bx), 0.5 * y + 0.25 * (ay + by)
            if abs(nx - x) + abs(ny - y) < 1e-3:
                continue
            now = line_cost(weight, stride, ax, ay, x, y) + line_cost(weight, stride, x, y, bx, by)
            new = line_cost(weight, stride, ax, ay, nx, ny) + line_cost(weight, stride, nx, ny, bx, by)
            if new <= now and new < math.inf:
                points[i, 0], points[i, 1] = nx, ny


def with_headings(points: NDArray[np.float64], last: float) -> NDArray[np.float64]:
    """Poses (n, 3): every point looks at the next one, the end looks at `last` (radians)."""
    step = np.diff(points, axis=0)
    yaw = np.append(np.arctan2(step[:, 1], step[:, 0]), last)
    return np.column_stack([points, yaw])
