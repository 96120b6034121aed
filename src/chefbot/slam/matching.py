"""Scan matching by hill climbing on the likelihood of a scan in a particle's map.

Lengths are in cells, relative to the corner of the tile table (see `shared_tiles`).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from chefbot.slam.shared_tiles import EMPTY, FAR_COORDINATE, SHIFT, SIDE, STRIDE

_MASK = SIDE - 1
_NO_SURFACE = np.float32(2.0) * FAR_COORDINATE * FAR_COORDINATE


@njit(cache=True, nogil=True, inline="always")
def _squared_distance(ex, ey, table, mean_x, mean_y):  # type: ignore[no-untyped-def]
    """Return the squared distance from a beam's end to the nearest mean in the 3 x 3 cells around it.

    The result is huge if there is none.
    """
    height, width = table.shape
    # Beams that end outside the map or in an empty tile match nothing
    if not (ex >= 0 and ey >= 0 and ex < width * SIDE and ey < height * SIDE):
        return _NO_SURFACE
    column, row = int(ex), int(ey)
    tile = table[row >> SHIFT, column >> SHIFT]
    if tile == EMPTY:
        return _NO_SURFACE
    # End point relative to the tile's corner; the halo makes all neighbours local
    fx = ex - np.float32(column & ~_MASK)
    fy = ey - np.float32(row & ~_MASK)
    cell = (row & _MASK) * STRIDE + (column & _MASK)
    best = _NO_SURFACE
    # Minimum over the 3 x 3 neighbourhood
    for k in range(3):
        row_start = cell + k * STRIDE
        for j in range(3):
            dx = mean_x[tile, row_start + j] - fx
            dy = mean_y[tile, row_start + j] - fy
            best = min(best, dx * dx + dy * dy)
    return best


@njit(cache=True, nogil=True)
def score(points, x, y, yaw, sharpness, table, mean_x, mean_y):  # type: ignore[no-untyped-def]
    """Return the sum over the beams of exp(-d^2 / sigma^2), d from the beam's end to the nearest surface.

    points: (n, 2) float32, ends of the beams in the base frame; sharpness: 1 / sigma^2. The exponential is
    approximated by (1 - u / 8)^8, cut to 0 from u = 8 on: the error is below 0.04 and it takes three
    multiplications.
    """
    c, s = np.float32(np.cos(yaw)), np.float32(np.sin(yaw))
    tx, ty = np.float32(x), np.float32(y)
    scale = np.float32(sharpness * 0.125)
    total = np.float32(0.0)
    for i in range(len(points)):
        px, py = points[i, 0], points[i, 1]
        # Transform the beam's end by the pose: R(yaw) p + t
        d2 = _squared_distance(c * px - s * py + tx, s * px + c * py + ty, table, mean_x, mean_y)
        # exp(-u) ~ (1 - u / 8)^8 by three squarings
        q = max(np.float32(1.0) - d2 * scale, np.float32(0.0))
        q *= q
        q *= q
        total += q * q
    return total


@njit(cache=True, nogil=True)
def match(  # type: ignore[no-untyped-def]
    points, start, prior, information, axis, beam_weight, steps, sharpness, table, mean_x, mean_y
):
    """Search from `start` for a local maximum of the log posterior of the pose.

    The log posterior is beam_weight * score - half the squared Mahalanobis distance to the prior. prior: (3,)
    pose that odometry proposes for this particle. information: (3,) inverse variances of its error along and
    across `axis` (rad) and in heading. steps: (linear, angular, number of halvings). Where the scan does not
    constrain the pose, as along a corridor, the prior decides. Return the pose (3,) and its score.
    """
    best = start.copy()
    best_score = score(points, best[0], best[1], best[2], sharpness, table, mean_x, mean_y)
    # Log posterior at the start: scan likelihood plus odometry prior
    value = beam_weight * best_score - _prior_cost(best, prior, information, axis)
    linear, angular = steps[0], steps[1]
    trial = best.copy()
    for _ in range(int(steps[2])):
        improved = True
        while improved:
            improved = False
            step_x, step_y = np.cos(best[2]) * linear, np.sin(best[2]) * linear
            # Test one step left and right turn, forward and back, left and right (robot frame)
            for k in range(6):
                sign = 1.0 if k % 2 == 0 else -1.0
                trial[0], trial[1], trial[2] = best[0], best[1], best[2]
                if k < 2:
                    trial[2] += sign * angular
                elif k < 4:
                    trial[0] += sign * step_x
                    trial[1] += sign * step_y
                else:
                    trial[0] -= sign * step_y
                    trial[1] += sign * step_x
                trial_score = score(points, trial[0], trial[1], trial[2], sharpness, table, mean_x, mean_y)
                trial_value = beam_weight * trial_score - _prior_cost(trial, prior, information, axis)
                # Accept every improvement
                if trial_value > value:
                    value, best_score, improved = trial_value, trial_score, True
                    best[0], best[1], best[2] = trial[0], trial[1], trial[2]
        # No better neighbour: halve the steps
        linear *= 0.5
        angular *= 0.5
    return best, best_score


@njit(cache=True, nogil=True)
def _prior_cost(pose, prior, information, axis):  # type: ignore[no-untyped-def]
    """Return half the squared Mahalanobis distance of a pose from the odometry prior."""
    dx, dy = pose[0] - prior[0], pose[1] - prior[1]
    c, s = np.cos(axis), np.sin(axis)
    # Difference in the principal axes of the prior
    along, across = c * dx + s * dy, c * dy - s * dx
    turn = pose[2] - prior[2]
    return 0.5 * (
        along * along * information[0] + across * across * information[1] + turn * turn * information[2]
    )


@njit(cache=True, nogil=True)
def match_all(  # type: ignore[no-untyped-def]
    points, poses, priors, information, axes, beam_weight, steps, sharpness, tables, mean_x, mean_y
):
    """Run `match` for every particle, in place in `poses` (p, 3); return the scores (p,)."""
    scores = np.empty(len(poses))
    for i in range(len(poses)):
        best, best_score = match(
            points, poses[i], priors[i], information, axes[i], beam_weight, steps, sharpness,
            tables[i], mean_x, mean_y,
        )  # fmt: skip
        poses[i, 0], poses[i, 1], poses[i, 2] = best[0], best[1], best[2]
        scores[i] = best_score
    return scores


@njit(cache=True, nogil=True)
def place_all(points, poses):  # type: ignore[no-untyped-def]
    """Transform points (n, 2) float32 by every pose (p, 3); return (p, n, 2) float32."""
    placed = np.empty((len(poses), len(points), 2), np.float32)
    for i in range(len(poses)):
        c, s = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        for j in range(len(points)):
            # R(yaw) p + t
            placed[i, j, 0] = c * points[j, 0] - s * points[j, 1] + poses[i, 0]
            placed[i, j, 1] = s * points[j, 0] + c * points[j, 1] + poses[i, 1]
    return placed
