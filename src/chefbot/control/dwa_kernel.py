"""Scores of the trajectories in the dynamic window (Fox, Burgard & Thrun 1997)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN

DEAREST = 252.0
TOO_FAST = 10.0
"""Price of 1 m/s more than the surroundings suggest; above what the way so won is worth."""
STEP = 0.075
"""Seconds between two looks along a trajectory: less than a cell of 5 cm at indoor speeds."""
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
def roll_out(
    cells: NDArray[np.uint8],
    x: float,
    y: float,
    yaw: float,
    now: tuple[float, float],
    target: tuple[float, float],
    ramp: float,
    end: float,
    remaining: float,
    limit: int,
) -> tuple[float, float, float, float, float, float, int, bool]:
    """Where the base gets in `end` seconds when it ramps from twist `now` to `target` in `ramp` seconds.

    x, y, speeds and `remaining` in cells. Ends early after `remaining` cells of way, or before a cell of cost
    `limit` or more. Returns x, y, yaw, way, time, mean cost, greatest cost, and whether it was blocked.
    """
    steps = math.ceil(end / STEP)
    dt = end / steps
    way, time, total, greatest = 0.0, 0.0, 0.0, 0
    for i in range(steps):
        f = min(1.0, (time + dt / 2) / ramp) if ramp > 0.0 else 1.0
        ds, turn = (now[0] + f * (target[0] - now[0])) * dt, (now[1] + f * (target[1] - now[1])) * dt
        chord = ds if abs(turn) < 1e-9 else ds * math.sin(turn / 2) / (turn / 2)
        nx, ny = x + chord * math.cos(yaw + turn / 2), y + chord * math.sin(yaw + turn / 2)
        cost = cost_at(cells, nx, ny)
        greatest = max(greatest, cost)
        if cost >= limit and ds > 0.0:
            return x, y, yaw, way, time, DEAREST, greatest, True
        x, y, yaw, way, time, total = nx, ny, yaw + turn, way + ds, time + dt, total + cost
        if way >= remaining:
            return x, y, yaw, way, time, total / (i + 1), greatest, False
    return x, y, yaw, way, time, total / steps, greatest, False


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
    remaining: float,
    sim_time: float,
    period: float,
    accelerations: NDArray[np.float64],
    max_speed: float,
    slowing: float,
    weights: NDArray[np.float64],
) -> int:
    """Index of the best admissible (v, w) of `twists` (n, 2), -1 if none is.

    pose, path, remaining: metres, relative to the corner of the costmap. now: (v, w). accelerations: forward and
    turning. weights: path, goal, heading, obstacle, change. Admissible is what can stop, after one more period,
    before it touches anything; from within the inscribed zone, what leaves it without touching a lethal cell.
    """
    x, y = pose[0] / resolution, pose[1] / resolution
    inside = cost_at(cells, x, y) >= INSCRIBED
    limit = LETHAL if inside else INSCRIBED
    best, least = -1, math.inf
    for i in range(twists.shape[0]):
        v, w = twists[i]
        ramp = max(abs(v - now[0]) / accelerations[0], abs(w - now[1]) / accelerations[1])
        soon = now[0] + (v - now[0]) * min(1.0, period / max(ramp, 1e-9))
        fastest = max(soon, now[0], 0.0)
        needed = (fastest * period + fastest * fastest / (2.0 * accelerations[0])) / resolution + 1.0
        ex, ey, eyaw, way, time, mean, greatest, blocked = roll_out(
            cells, x, y, pose[2], (now[0] / resolution, now[1]), (v / resolution, w), ramp, sim_time,
            remaining / resolution, limit,
        )  # fmt: skip
        if blocked and (way < needed or v < IN_PLACE):
            continue
        if inside and v > IN_PLACE and not blocked and cost_at(cells, ex, ey) >= INSCRIBED:
            continue
        along, across, off = _deviation(path, ex * resolution, ey * resolution, eyaw)
        along += v * (sim_time - time) * (0.0 if blocked else 1.0)
        score = weights[0] * across - weights[1] * along + weights[2] * off
        score += weights[3] * mean / DEAREST + weights[4] * abs(w - now[1])
        calm = max_speed * (1.0 - slowing * min(greatest, DEAREST) / DEAREST)
        score += TOO_FAST * max(0.0, v - calm)
        if score < least:
            best, least = i, score
    return best
