"""How well a scan fits a particle's map, and the pose nearby where it fits best.

Lengths are in cells, relative to the corner of the tile table (see `tiles`).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from chefbot.slam.shared_tiles import EMPTY, FAR, SHIFT, SIDE, STRIDE

_MASK = SIDE - 1
_NONE = np.float32(2.0) * FAR * FAR


@njit(cache=True, nogil=True, inline="always")
def _squared_distance(ex, ey, table, mean_x, mean_y):  # type: ignore[no-untyped-def]
    """From a beam's end to the nearest mean in the 3 x 3 cells around it; huge if there is none."""
    height, width = table.shape
    if not (ex >= 0 and ey >= 0 and ex < width * SIDE and ey < height * SIDE):
        return _NONE
    column, row = int(ex), int(ey)
    tile = table[row >> SHIFT, column >> SHIFT]
    if tile == EMPTY:
        return _NONE
    fx = ex - np.float32(column & ~_MASK)
    fy = ey - np.float32(row & ~_MASK)
    cell = (row & _MASK) * STRIDE + (column & _MASK)
    best = _NONE
    for k in range(3):
        at = cell + k * STRIDE
        for j in range(3):
            dx = mean_x[tile, at + j] - fx
            dy = mean_y[tile, at + j] - fy
            best = min(best, dx * dx + dy * dy)
    return best


@njit(cache=True, nogil=True)
def score(points, x, y, yaw, sharpness, table, mean_x, mean_y):  # type: ignore[no-untyped-def]
    """Sum over the beams of exp(-d^2 / sigma^2), d from the beam's end to the nearest mapped surface.

    points: (n, 2) float32, ends of the beams seen from the robot; sharpness: 1 / sigma^2.
    The exponential is (1 - u / 8)^8, cut to 0 from u = 8 on: within 0.04 of it, and three products.
    """
    c, s = np.float32(np.cos(yaw)), np.float32(np.sin(yaw))
    tx, ty = np.float32(x), np.float32(y)
    scale = np.float32(sharpness * 0.125)
    total = np.float32(0.0)
    for i in range(len(points)):
        px, py = points[i, 0], points[i, 1]
        d2 = _squared_distance(c * px - s * py + tx, s * px + c * py + ty, table, mean_x, mean_y)
        q = max(np.float32(1.0) - d2 * scale, np.float32(0.0))
        q *= q
        q *= q
        total += q * q
    return total


@njit(cache=True, nogil=True)
def match(  # type: ignore[no-untyped-def]
    points, start, prior, information, axis, beam_weight, steps, sharpness, table, mean_x, mean_y
):
    """Climb from `start` to a maximum of beam_weight * score - the odometry's squared error / 2.

    prior: (3,) the pose that odometry proposes for this particle. information: (3,) inverse variances of its
    error along and across `axis` (rad) and in heading. steps: (linear, angular, halvings).
    Where the scan does not say where the robot is, as along a corridor, the prior decides.
    Returns the pose (3,) and its score.
    """
    best = start.copy()
    found = score(points, best[0], best[1], best[2], sharpness, table, mean_x, mean_y)
    value = beam_weight * found - _surprise(best, prior, information, axis)
    linear, angular = steps[0], steps[1]
    trial = best.copy()
    for _ in range(int(steps[2])):
        improved = True
        while improved:
            improved = False
            c, s = np.cos(best[2]) * linear, np.sin(best[2]) * linear
            for k in range(6):
                sign = 1.0 if k % 2 == 0 else -1.0
                trial[0], trial[1], trial[2] = best[0], best[1], best[2]
                if k < 2:
                    trial[2] += sign * angular
                elif k < 4:
                    trial[0] += sign * c
                    trial[1] += sign * s
                else:
                    trial[0] -= sign * s
                    trial[1] += sign * c
                fits = score(points, trial[0], trial[1], trial[2], sharpness, table, mean_x, mean_y)
                worth = beam_weight * fits - _surprise(trial, prior, information, axis)
                if worth > value:
                    value, found, improved = worth, fits, True
                    best[0], best[1], best[2] = trial[0], trial[1], trial[2]
        linear *= 0.5
        angular *= 0.5
    return best, found


@njit(cache=True, nogil=True)
def _surprise(pose, prior, information, axis):  # type: ignore[no-untyped-def]
    """Half the squared Mahalanobis distance from what odometry says."""
    dx, dy = pose[0] - prior[0], pose[1] - prior[1]
    c, s = np.cos(axis), np.sin(axis)
    along, across = c * dx + s * dy, c * dy - s * dx
    turn = pose[2] - prior[2]
    return 0.5 * (
        along * along * information[0] + across * across * information[1] + turn * turn * information[2]
    )


@njit(cache=True, nogil=True)
def match_all(  # type: ignore[no-untyped-def]
    points, poses, priors, information, axes, beam_weight, steps, sharpness, tables, mean_x, mean_y
):
    """`match` for every particle, in place in `poses` (p, 3); returns the scores (p,)."""
    scores = np.empty(len(poses))
    for i in range(len(poses)):
        best, found = match(
            points, poses[i], priors[i], information, axes[i], beam_weight, steps, sharpness,
            tables[i], mean_x, mean_y,
        )  # fmt: skip
        poses[i, 0], poses[i, 1], poses[i, 2] = best[0], best[1], best[2]
        scores[i] = found
    return scores


@njit(cache=True, nogil=True)
def place_all(points, poses):  # type: ignore[no-untyped-def]
    """points (n, 2) float32 seen from each pose (p, 3): (p, n, 2) float32."""
    placed = np.empty((len(poses), len(points), 2), np.float32)
    for i in range(len(poses)):
        c, s = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        for j in range(len(points)):
            placed[i, j, 0] = c * points[j, 0] - s * points[j, 1] + poses[i, 0]
            placed[i, j, 1] = s * points[j, 0] + c * points[j, 1] + poses[i, 1]
    return placed
