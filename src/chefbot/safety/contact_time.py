"""Time until a robot that keeps its twist touches a point, in closed form.

A twist (v, w) moves the robot on a circle about the instantaneous centre of rotation (0, v / w) (Siegwart &
Nourbakhsh 2004, 3.2); seen from the robot each point moves backwards on a circle about the same centre. All points
are in base_link, and the body is a disc about its origin or a convex polygon.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
NO_CONTACT = math.inf
MAX_STRAIGHT_CURVATURE = 1e-4
"""Turn rate per speed, 1/m, below which the arc is a straight line."""
APPROACH_RATE = 1e-6
"""Speed, m/s, above which a point that is within the body's outline already counts as coming nearer."""
TOUCH_DISTANCE = 1e-6
"""Distance, m, within which a point touches the body: nearer to it the closed forms lose all their digits, and the
contact that is due now would be found a whole turn later."""
OWN_PART_DEPTH = 0.5
"""Share of the inscribed radius: a point that lies deeper inside the body is a part of the robot itself."""


@njit(cache=True, nogil=True)
def _angle_along(angle: float) -> float:
    """Return an angle in [0, 2 pi)."""
    return angle % (2.0 * math.pi)


@njit(cache=True, nogil=True)
def disc_contact(x: float, y: float, v: float, w: float, radius: float) -> float:
    """Return the time (s) until a disc touches the point; 0 if it does already and would come nearer."""
    if math.hypot(x, y) <= radius + TOUCH_DISTANCE:
        return 0.0 if v * x > APPROACH_RATE * radius else NO_CONTACT
    if abs(v) < APPROACH_RATE:
        return NO_CONTACT
    if abs(w) < MAX_STRAIGHT_CURVATURE * abs(v):
        along = x if v > 0.0 else -x
        if along <= 0.0 or abs(y) >= radius:
            return NO_CONTACT
        return (along - math.sqrt(radius * radius - y * y)) / abs(v)
    # law of cosines in the triangle of the centre of rotation, the point, and the robot when it touches the point
    centre = v / w
    rho, d = abs(centre), math.hypot(x, y - centre)
    if d == 0.0:
        return NO_CONTACT
    cosine = (rho * rho + d * d - radius * radius) / (2.0 * rho * d)
    if cosine >= 1.0:
        return NO_CONTACT
    ahead = math.atan2(y - centre, x) - math.atan2(-centre, 0.0)
    return _angle_along((ahead if w > 0.0 else -ahead) - math.acos(cosine)) / abs(w)


@njit(cache=True, nogil=True)
def _depth_and_rate(x: float, y: float, v: float, w: float, corners: Floats) -> tuple[float, float]:
    """Return the signed distance (m) of a point from the nearest edge, negative inside, and its change (m/s)."""
    n, nearest, rate = corners.shape[0], -math.inf, 0.0
    for i in range(n):
        ax, ay = corners[i, 0], corners[i, 1]
        ex, ey = corners[(i + 1) % n, 0] - ax, corners[(i + 1) % n, 1] - ay
        length = math.hypot(ex, ey)
        nx, ny = ey / length, -ex / length  # outwards, as the corners are counter-clockwise
        distance = (x - ax) * nx + (y - ay) * ny
        if distance > nearest:
            # velocity of a point at rest, seen from the robot
            nearest, rate = distance, (w * y - v) * nx - w * x * ny
    return nearest, rate


@njit(cache=True, nogil=True)
def _straight_into_edge(x: float, y: float, v: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the time until a point that moves by -v along x meets the edge from a to b."""
    if (ay - y) * (by - y) > 0.0 or ay == by:
        return NO_CONTACT
    t = (x - (ax + (bx - ax) * (y - ay) / (by - ay))) / v
    return t if t >= 0.0 else NO_CONTACT


@njit(cache=True, nogil=True)
def _arc_into_edge(
    x: float, y: float, v: float, w: float, ax: float, ay: float, bx: float, by: float
) -> float:
    """Return the time until a point that turns by -w about the centre of rotation meets the edge from a to b."""
    centre = v / w
    squared = x * x + (y - centre) * (y - centre)
    ex, ey = bx - ax, by - ay
    # |a + s e - c|^2 = r^2 for s in [0, 1]
    qa, qb = ex * ex + ey * ey, ax * ex + (ay - centre) * ey
    root = qb * qb - qa * (ax * ax + (ay - centre) * (ay - centre) - squared)
    if root < 0.0:
        return NO_CONTACT
    first, start = NO_CONTACT, math.atan2(y - centre, x)
    for sign in (-1.0, 1.0):
        s = (-qb + sign * math.sqrt(root)) / qa
        if 0.0 <= s <= 1.0:
            angle = math.atan2(ay + s * ey - centre, ax + s * ex) - start
            first = min(first, _angle_along(-angle if w > 0.0 else angle) / abs(w))
    return first


@njit(cache=True, nogil=True)
def polygon_contact(x: float, y: float, v: float, w: float, corners: Floats) -> float:
    """Return the time (s) until a convex polygon (n, 2) touches the point; 0 if it does and would come nearer."""
    depth, rate = _depth_and_rate(x, y, v, w, corners)
    if depth <= TOUCH_DISTANCE:
        return 0.0 if rate < -APPROACH_RATE else NO_CONTACT
    n, first = corners.shape[0], NO_CONTACT
    straight = abs(w) <= MAX_STRAIGHT_CURVATURE * abs(v)
    if straight and abs(v) < APPROACH_RATE:
        return NO_CONTACT
    for i in range(n):
        ax, ay, bx, by = corners[i, 0], corners[i, 1], corners[(i + 1) % n, 0], corners[(i + 1) % n, 1]
        if straight:
            first = min(first, _straight_into_edge(x, y, v, ax, ay, bx, by))
        else:
            first = min(first, _arc_into_edge(x, y, v, w, ax, ay, bx, by))
    return first


@njit(cache=True, nogil=True)
def first_contact(
    points: Floats, v: float, w: float, radius: float, corners: Floats, inscribed: float
) -> tuple[float, int]:
    """Return the time (s) until the body touches the first of the points (n, 2), inf for none, and its index or -1.

    radius: of the disc, m; unused if `corners` (n, 2) of a convex polygon are given. inscribed: radius of the largest
    circle inside the body; points deep inside it are parts of the robot.
    """
    first, index = NO_CONTACT, -1
    own_squared = (OWN_PART_DEPTH * inscribed) ** 2
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        if x * x + y * y < own_squared:
            continue
        t = polygon_contact(x, y, v, w, corners) if corners.shape[0] else disc_contact(x, y, v, w, radius)
        if t < first:
            first, index = t, i
    return first, index


@njit(cache=True, nogil=True)
def distance_from_body(x: float, y: float, radius: float, corners: Floats) -> float:
    """Return the distance (m) of a point from a disc, or from a convex polygon (n, 2); negative inside."""
    n = corners.shape[0]
    if n == 0:
        return math.hypot(x, y) - radius
    depth, _ = _depth_and_rate(x, y, 0.0, 0.0, corners)
    if depth <= 0.0:
        return depth
    nearest = math.inf
    for i in range(n):
        ax, ay = corners[i, 0], corners[i, 1]
        ex, ey = corners[(i + 1) % n, 0] - ax, corners[(i + 1) % n, 1] - ay
        along = ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)
        along = min(1.0, max(0.0, along))
        nearest = min(nearest, math.hypot(x - ax - along * ex, y - ay - along * ey))
    return nearest
