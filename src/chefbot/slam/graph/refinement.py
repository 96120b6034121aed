"""Refinement of a matched pose: point-to-line Gauss-Newton on the mean surface points of a submap."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chefbot.slam.graph.surface_grid import CELL

ITERATIONS = 8
SURFACE_NOISE = 0.03
"""Standard deviation of a point about a mean surface, m."""
_FIRST_SCALE, _LAST_SCALE = 0.2, 0.06
"""Scale of the robust kernel in m at the first iteration and at the last."""
_POINT_WEIGHT = 0.25
"""Weight in each axis of a point that lies on no line."""
_STOP_LINEAR, _STOP_ANGULAR = 1e-4, 2e-5


@njit(cache=True, nogil=True)
def refine(points, normals, start, prior, information, beams, slot, totals, origin):  # type: ignore[no-untyped-def]
    """Return the maximum a posteriori pose (3,), the information (3, 3) of the scan, and the share of inliers.

    points, normals: (n, 2) float32 in the base frame. prior, information: odometry's pose (3,) and its
    information (3, 3). beams: the scan counts as at most so many independent points. A direction that no
    surface faces, as along a corridor, gets no information from the scan: there the odometry prior decides.
    """
    pose = start.copy()
    scan_information = np.zeros((3, 3))
    share = 0.0
    for iteration in range(ITERATIONS):
        scale = max(_FIRST_SCALE * 0.6**iteration, _LAST_SCALE)
        h, g, inliers = linearized(points, normals, pose, scale, slot, totals, origin)
        share = inliers / max(len(points), 1)
        weight = min(1.0, beams / max(len(points), 1)) / SURFACE_NOISE**2
        scan_information = h * weight
        # Odometry prior: add its information and its gradient
        error = pose - prior
        gradient = g * weight + information @ error
        step = np.linalg.solve(scan_information + information, -gradient)
        pose += step
        settled = abs(step[0]) + abs(step[1]) < _STOP_LINEAR and abs(step[2]) < _STOP_ANGULAR
        if settled and scale <= _LAST_SCALE:
            break
    return pose, scan_information, share


@njit(cache=True, nogil=True)
def linearized(points, normals, pose, scale, slot, totals, origin):  # type: ignore[no-untyped-def]
    """Return J^T W J (3, 3), J^T W r (3,) of the distances along the normals, and the sum of the weights."""
    h, g = np.zeros((3, 3)), np.zeros(3)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    height, width = slot.shape
    inliers = 0.0
    for i in range(len(points)):
        # Point and normal in the frame of the submap
        rx, ry = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
        x, y = rx + pose[0], ry + pose[1]
        nx, ny = c * normals[i, 0] - s * normals[i, 1], s * normals[i, 0] + c * normals[i, 1]
        u, v = (x - origin[0]) / CELL, (y - origin[1]) / CELL
        if not (u >= 1.0 and v >= 1.0 and u < width - 1 and v < height - 1):
            continue
        # Nearest mean in the 5 x 5 cells around
        column, row = int(u), int(v)
        best, near_x, near_y = 1e9, 0.0, 0.0
        for b in range(max(row - 2, 0), min(row + 3, height)):
            for a in range(max(column - 2, 0), min(column + 3, width)):
                k = slot[b, a]
                if k >= 0:
                    dx, dy = x - totals[k, 0] / totals[k, 2], y - totals[k, 1] / totals[k, 2]
                    distance = dx * dx + dy * dy
                    if distance < best:
                        best, near_x, near_y = distance, dx, dy
        if best > 9.0 * scale * scale:
            continue
        if nx != 0.0 or ny != 0.0:
            inliers += _accumulate(h, g, nx, ny, rx, ry, nx * near_x + ny * near_y, scale, 1.0)
        else:
            # A point of no line: its distance in both axes
            inliers += _accumulate(h, g, 1.0, 0.0, rx, ry, near_x, scale, _POINT_WEIGHT)
            inliers += _accumulate(h, g, 0.0, 1.0, rx, ry, near_y, scale, _POINT_WEIGHT)
    return h, g, inliers


@njit(cache=True, nogil=True, inline="always")
def _accumulate(h, g, nx, ny, rx, ry, residual, scale, share):  # type: ignore[no-untyped-def]
    """Add a residual along (nx, ny) of the point (rx, ry), rotated into the submap, and return its weight."""
    # Geman-McClure weight
    q = scale * scale / (scale * scale + residual * residual)
    w = share * q * q
    # Jacobian of the distance along the normal: by x, y and heading
    turn = ny * rx - nx * ry
    g[0] += w * nx * residual
    g[1] += w * ny * residual
    g[2] += w * turn * residual
    h[0, 0] += w * nx * nx
    h[0, 1] += w * nx * ny
    h[0, 2] += w * nx * turn
    h[1, 0] += w * nx * ny
    h[1, 1] += w * ny * ny
    h[1, 2] += w * ny * turn
    h[2, 0] += w * nx * turn
    h[2, 1] += w * ny * turn
    h[2, 2] += w * turn * turn
    return w
