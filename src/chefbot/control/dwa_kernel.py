"""Scores of the trajectories in the dynamic window (Fox, Burgard & Thrun 1997)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.control.controller import INSCRIBED, LETHAL, UNKNOWN

DEAREST = 252.0
TOO_FAST = 10.0
"""Price of 1 m/s more than the surroundings suggest; above what the way so won is worth."""
IN_PLACE = 1e-3
"""m/s below which a trajectory turns on the spot; a disk touches nothing by that."""


@njit(cache=True, nogil=True)
def cost_at(cells: NDArray[np.uint8], column: float, row: float) -> int:
    """Cost at a place in cells; unknown and outside count as free."""
    r, c = math.floor(row), math.floor(column)
    if r < 0 or c < 0 or r >= cells.shape[0] or c >= cells.shape[1]:
        return 0
    cost = cells[r, c]
    return 0 if cost == UNKNOWN else int(cost)


@njit(cache=True, nogil=True)
def follow_arc(
    cells: NDArray[np.uint8], x: float, y: float, yaw: float, v: float, w: float, length: float, limit: int
) -> tuple[float, float, float, float, float, int]:
    """Along the exact arc until `length` cells are done or a cell of cost `limit` or more is met.

    x, y, v and length in cells. Returns x, y, yaw at the end, cells free, mean cost, greatest cost.
    """
    steps = max(1, math.ceil(2.0 * length))
    ds = length / steps
    turn = w / v * ds
    chord = ds if abs(turn) < 1e-9 else ds * math.sin(turn / 2) / (turn / 2)
    c, s = math.cos(yaw + turn / 2) * chord, math.sin(yaw + turn / 2) * chord
    ct, st = math.cos(turn), math.sin(turn)
    total, greatest = 0.0, 0
    for i in range(steps):
        nx, ny = x + c, y + s
        cost = cost_at(cells, nx, ny)
        greatest = max(greatest, cost)
        if cost >= limit:
            return x, y, yaw + turn * i, ds * i, DEAREST, greatest
        total += cost
        x, y = nx, ny
        c, s = c * ct - s * st, c * st + s * ct
    return x, y, yaw + turn * steps, length, total / steps, greatest


@njit(cache=True, nogil=True)
def nearest_on_path(path: NDArray[np.float64], x: float, y: float) -> tuple[int, float]:
    """(index, squared distance) of the pose of the path (n, 3) nearest to the point."""
    best, least = 0, math.inf
    for i in range(path.shape[0]):
        dx, dy = path[i, 0] - x, path[i, 1] - y
        d = dx * dx + dy * dy
        if d < least:
            best, least = i, d
    return best, least


@njit(cache=True, nogil=True)
def _deviation(path: NDArray[np.float64], x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """(metres along the path, metres off it, radians off its direction) of a pose."""
    i, squared = nearest_on_path(path, x, y)
    dx, dy = x - path[i, 0], y - path[i, 1]
    c, s = math.cos(path[i, 2]), math.sin(path[i, 2])
    along, across = c * dx + s * dy, abs(c * dy - s * dx)
    if i == path.shape[0] - 1 or i == 0:
        across = math.sqrt(squared) if along * (1 if i else -1) > 0 else across
    off = (yaw - path[i, 2] + math.pi) % (2 * math.pi) - math.pi
    spacing = math.hypot(path[1, 0] - path[0, 0], path[1, 1] - path[0, 1])
    return i * spacing + along, across, abs(off)


@njit(cache=True, nogil=True)
def best_twist(
    cells: NDArray[np.uint8],
    resolution: float,
    pose: NDArray[np.float64],
    twists: NDArray[np.float64],
    now: NDArray[np.float64],
    path: NDArray[np.float64],
    sim_time: float,
    period: float,
    braking: float,
    max_speed: float,
    slowing: float,
    weights: NDArray[np.float64],
) -> int:
    """Index of the best admissible (v, w) of `twists` (n, 2), -1 if none is.

    pose, path: metres, relative to the corner of the costmap. now: (v, w). weights: path, goal, heading,
    obstacle, change. Admissible is what can stop, after one more period at that speed, before it touches
    anything; from within the inscribed zone, what leaves it slowly without touching a lethal cell.
    """
    x, y = pose[0] / resolution, pose[1] / resolution
    here = min(cost_at(cells, x, y), INSCRIBED - 1)
    inside = cost_at(cells, x, y) >= INSCRIBED
    limit = LETHAL if inside else INSCRIBED
    best, least = -1, math.inf
    for i in range(twists.shape[0]):
        v, w = twists[i]
        ex, ey, eyaw, mean, greatest = x, y, pose[2] + w * sim_time, float(here), here
        if v > IN_PLACE:
            needed = (v * period + v * v / (2.0 * braking)) / resolution + 1.0
            length = max(v * sim_time / resolution, needed)
            ex, ey, eyaw, free, mean, greatest = follow_arc(
                cells, x, y, pose[2], v / resolution, w, length, limit
            )
            if free < needed or (inside and cost_at(cells, ex, ey) >= INSCRIBED):
                continue
        along, across, off = _deviation(path, ex * resolution, ey * resolution, eyaw)
        score = weights[0] * across - weights[1] * along + weights[2] * off
        score += weights[3] * mean / DEAREST + weights[4] * abs(w - now[1])
        calm = max_speed * (1.0 - slowing * min(greatest, DEAREST) / DEAREST)
        score += TOO_FAST * max(0.0, v - calm)
        if score < least:
            best, least = i, score
    return best
