"""Path smoothing: shortcuts along straight lines, resampling and rounding of corners, never at a higher cost."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.planning.cost_grid import CostGrid

MAX_SHORTCUT_CELLS = 200
"""Maximum length of a shortcut in cells; bounds its computation time."""


@njit(cache=True, nogil=True)
def line_cost(grid: CostGrid, x0: float, y0: float, x1: float, y1: float) -> float:
    """Return the integral of the weight along a straight line, in cells; inf if it touches a blocked cell or leads
    against a one-way lane.

    Traverses every cell that the line crosses (Amanatides & Woo 1987). x, y in cells of the grid; both ends must be
    on it.
    """
    c, r = math.floor(x0), math.floor(y0)
    dx, dy = x1 - x0, y1 - y0
    length = math.hypot(dx, dy)
    # t runs from 0 to 1 along the line: increments per cell, and t at the next cell borders
    step_c, step_r = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    delta_c = abs(1.0 / dx) if dx != 0.0 else math.inf
    delta_r = abs(1.0 / dy) if dy != 0.0 else math.inf
    next_c = ((c + 1 - x0) if dx > 0 else (x0 - c)) * delta_c if dx != 0.0 else math.inf
    next_r = ((r + 1 - y0) if dy > 0 else (y0 - r)) * delta_r if dy != 0.0 else math.inf
    t, integral = 0.0, 0.0
    while True:
        w = grid.weight[grid.cells[r * grid.stride + c]]
        if w == 0:
            return math.inf
        if grid.lane.shape[0] > 0:
            direction = grid.direction[grid.lane[r * grid.stride + c]]
            if direction[0] * dx + direction[1] * dy < -1e-6:
                return math.inf
        # add the piece up to the next cell border or the end of the line
        t_next = min(next_c, next_r, 1.0)
        integral += (t_next - t) * length * w
        if t_next >= 1.0:
            return integral
        t = t_next
        # advance to the neighbouring cell across that border
        if next_c < next_r:
            c += step_c
            next_c += delta_c
        else:
            r += step_r
            next_r += delta_r


@njit(cache=True, nogil=True)
def pull(grid: CostGrid, g: NDArray[np.float32], chain: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices into the cells `chain` of the corners that remain after shortcutting.

    A straight line replaces a piece of the chain wherever its cost is not higher. g: cost-to-come, flat.
    """
    kept, stride = [0], grid.stride
    anchor = 0
    while anchor < chain.shape[0] - 1:
        # the furthest cell that a straight line from the anchor reaches at no higher cost
        furthest = anchor + 1
        x0, y0 = chain[anchor] % stride + 0.5, chain[anchor] // stride + 0.5
        for j in range(anchor + 2, min(anchor + MAX_SHORTCUT_CELLS, chain.shape[0])):
            x1, y1 = chain[j] % stride + 0.5, chain[j] // stride + 0.5
            if line_cost(grid, x0, y0, x1, y1) > (g[chain[j]] - g[chain[anchor]]) * 1.0001:
                break
            furthest = j
        anchor = furthest
        kept.append(anchor)
    return np.array(kept)


def resample(points: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return points (m, 2) along the polyline (n, 2), n >= 2, at most `spacing` apart, with all its corners."""
    pieces = [points[:1]]
    for a, b in pairwise(points):
        count = max(1, math.ceil(math.hypot(*(b - a)) / spacing - 1e-6))
        pieces.append(a + np.arange(1, count + 1)[:, None] / count * (b - a))
    return np.concatenate(pieces)


@njit(cache=True, nogil=True)
def relax(grid: CostGrid, points: NDArray[np.float64], sweeps: int) -> None:
    """Move inner points (n, 2), in cells, towards the middle of their neighbours where that makes the path
    cheaper."""
    for _ in range(sweeps):
        for i in range(1, points.shape[0] - 1):
            ax, ay, x, y = points[i - 1, 0], points[i - 1, 1], points[i, 0], points[i, 1]
            bx, by = points[i + 1, 0], points[i + 1, 1]
            # candidate: halfway to the middle of the two neighbours
            nx, ny = 0.5 * x + 0.25 * (ax + bx), 0.5 * y + 0.25 * (ay + by)
            if abs(nx - x) + abs(ny - y) < 1e-3:
                continue
            # accept it only if the cost of the two segments does not rise
            before = line_cost(grid, ax, ay, x, y)
            cost = before + line_cost(grid, x, y, bx, by)
            before = line_cost(grid, ax, ay, nx, ny)
            new = before + line_cost(grid, nx, ny, bx, by)
            if new <= cost and new < math.inf:
                points[i, 0], points[i, 1] = nx, ny


def with_headings(points: NDArray[np.float64], last: float) -> NDArray[np.float64]:
    """Return poses (n, 3): each point heads to the next one, the last one has the heading `last`, rad."""
    step = np.diff(points, axis=0)
    yaw = np.append(np.arctan2(step[:, 1], step[:, 0]), last)
    return np.column_stack([points, yaw])
