"""Point-to-line registration of many pairs of scans, linearized at their present poses.

The normal equations of each pair are an edge of the pose graph (Lu & Milios, Globally Consistent Range Scan
Alignment for Environment Mapping, Autonomous Robots 4, 1997, with the metric of Censi, ICRA 2008).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

_REACH, _REACH_PER_RANGE = 0.2, 0.05
"""Largest distance of corresponding points, m, and its growth with the range: far surfaces are sampled sparsely."""
_MIN_COSINE = 0.7
"""Smallest cosine of the angle between the normals of corresponding points."""
_POINT_WEIGHT = 0.1
_MAX_STEPS = 60
"""Number of neighbours in bearing that are looked at on each side."""


@njit(cache=True, nogil=True)
def linearize_pairs(of, to, poses, points, normals, bearings, begin, sensors, scale):  # type: ignore[no-untyped-def]
    """Return for each pair J^T W J (m, 4, 4), J^T W r (m, 4), and the numbers of points, paired and in total (m, 2).

    of, to: (m,) indices. Varied are the pose of scan `to` in the frame of scan `of`, in the axes of that, and an
    offset that all ranges share. points, normals, bearings: of all scans, scan k from begin[k] to begin[k + 1].
    scale: width of the robust kernel, m.
    """
    m = len(of)
    h, g, counts = np.zeros((m, 4, 4)), np.zeros((m, 4)), np.zeros((m, 2))
    for k in range(m):
        a, b = of[k], to[k]
        # Pose of scan `to` in the frame of scan `of`
        c, s = math.cos(poses[a, 2]), math.sin(poses[a, 2])
        dx, dy = poses[b, 0] - poses[a, 0], poses[b, 1] - poses[a, 1]
        x, y, yaw = c * dx + s * dy, c * dy - s * dx, poses[b, 2] - poses[a, 2]
        counts[k, 0] = _linearize(
            points[begin[a] : begin[a + 1]], normals[begin[a] : begin[a + 1]], bearings[begin[a] : begin[a + 1]],
            sensors[a], points[begin[b] : begin[b + 1]], normals[begin[b] : begin[b + 1]], sensors[b], x, y, yaw,
            scale, h[k], g[k],
        )  # fmt: skip
        counts[k, 1] = begin[b + 1] - begin[b]
    return h, g, counts


@njit(cache=True, nogil=True)
def _linearize(  # type: ignore[no-untyped-def]
    points, normals, bearings, sensor, moved, moved_normals, moved_sensor, x, y, yaw, scale, h, g
):
    """Add the normal equations of one pair to h (4, 4) and g (4,); return the number of paired points."""
    c, s = math.cos(yaw), math.sin(yaw)
    paired = 0.0
    for i in range(len(moved)):
        rx, ry = c * moved[i, 0] - s * moved[i, 1], s * moved[i, 0] + c * moved[i, 1]
        px, py = rx + x, ry + y
        near, squared = _nearest(points, bearings, sensor, px, py)
        if near < 0:
            continue
        limit = _REACH + _REACH_PER_RANGE * math.hypot(px - sensor[0], py - sensor[1])
        if squared > limit * limit:
            continue
        ex, ey = px - points[near, 0], py - points[near, 1]
        nx, ny = normals[near, 0], normals[near, 1]
        mx = c * moved_normals[i, 0] - s * moved_normals[i, 1]
        my = s * moved_normals[i, 0] + c * moved_normals[i, 1]
        known, moved_known = nx != 0.0 or ny != 0.0, mx != 0.0 or my != 0.0
        if known and moved_known:
            # Surfaces that face different ways are not the same
            if nx * mx + ny * my < _MIN_COSINE:
                continue
        elif moved_known:
            nx, ny = mx, my
        # Difference of the directions of both beams: how a range offset parts the points
        ux, uy = _direction(moved[i, 0] - moved_sensor[0], moved[i, 1] - moved_sensor[1])
        vx, vy = _direction(points[near, 0] - sensor[0], points[near, 1] - sensor[1])
        ux, uy = c * ux - s * uy - vx, s * ux + c * uy - vy
        if known or moved_known:
            paired += _accumulate(h, g, nx, ny, rx, ry, ux, uy, nx * ex + ny * ey, scale, 1.0)
        else:
            paired += _accumulate(h, g, 1.0, 0.0, rx, ry, ux, uy, ex, scale, _POINT_WEIGHT)
            paired += _accumulate(h, g, 0.0, 1.0, rx, ry, ux, uy, ey, scale, _POINT_WEIGHT)
    return paired


@njit(cache=True, nogil=True, inline="always")
def _direction(x, y):  # type: ignore[no-untyped-def]
    length = max(math.hypot(x, y), 1e-6)
    return x / length, y / length


@njit(cache=True, nogil=True)
def _nearest(points, bearings, sensor, x, y):  # type: ignore[no-untyped-def]
    """Return the index of the point nearest to (x, y) and the squared distance; -1 if there is none near."""
    n = len(points)
    if n == 0:
        return -1, 0.0
    dx, dy = x - sensor[0], y - sensor[1]
    distance = math.hypot(dx, dy)
    bearing = math.atan2(dy, dx)
    # Bearing within the turn that the scan's bearings lie in
    bearing += 2.0 * math.pi * math.ceil((bearings[0] - bearing) / (2.0 * math.pi))
    low = np.searchsorted(bearings, bearing)
    limit = _REACH + _REACH_PER_RANGE * distance
    # Points further away in bearing than the limit allows cannot be near
    span = math.pi if distance <= limit else math.asin(limit / distance)
    best, index, steps = limit * limit, -1, min(_MAX_STEPS, n)
    # Upwards past the end of a full turn to its beginning, and downwards the other way round
    for k in range(low, low + steps):
        i, turn = (k, 0.0) if k < n else (k - n, 2.0 * math.pi)
        if bearings[i] + turn - bearing > span:
            break
        ex, ey = x - points[i, 0], y - points[i, 1]
        if ex * ex + ey * ey < best:
            best, index = ex * ex + ey * ey, i
    for k in range(low - 1, low - 1 - steps, -1):
        i, turn = (k, 0.0) if k >= 0 else (k + n, 2.0 * math.pi)
        if bearing - bearings[i] + turn > span:
            break
        ex, ey = x - points[i, 0], y - points[i, 1]
        if ex * ex + ey * ey < best:
            best, index = ex * ex + ey * ey, i
    return index, best


@njit(cache=True, nogil=True, inline="always")
def _accumulate(h, g, nx, ny, rx, ry, ux, uy, residual, scale, share):  # type: ignore[no-untyped-def]
    """Add a residual along (nx, ny) of the point (rx, ry), rotated only, and return its weight."""
    # Geman-McClure weight
    q = scale * scale / (scale * scale + residual * residual)
    w = share * q * q
    # Jacobian of the distance along the normal: by x, y, heading and range offset
    j = (nx, ny, ny * rx - nx * ry, nx * ux + ny * uy)
    for a in range(4):
        g[a] += w * j[a] * residual
        for b in range(4):
            h[a, b] += w * j[a] * j[b]
    return w
