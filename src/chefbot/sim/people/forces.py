"""Social forces on people, as accelerations in m/s^2.

The driving force and the bound of the speed are those of Helbing & Molnar, "Social force model for pedestrian
dynamics", Physical Review E 51 (1995) 4282: equations (2), (11) and (12), and (7) for what lies behind. The
interaction of two people is that which Moussaid et al. measured, Proceedings of the Royal Society B 276 (2009) 2755,
and with which they describe groups, PLoS ONE 5 (2010) e10047. It depends on the relative velocity, so that people
evade to a side early instead of braking in front of each other. Walls repel as in these papers.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.sim.people.distance_field import Field, Floats, away_from_obstacle, distance_at, is_visible
from chefbot.sim.people.pinned_maths import PI, bearing, exp_minus
from chefbot.sim.people.walkers import Surroundings, Walkers

RELAXATION = 0.5
"""Time in which people reach their speed, s (tau; Helbing & Molnar)."""
STRENGTH = 4.5
"""Strength of the interaction of two people, m/s^2 (A; Moussaid 2009)."""
VELOCITY_SHARE = 2.0
"""Weight of the relative velocity against the direction (lambda; Moussaid 2009)."""
RANGE_FACTOR = 0.35
"""Range of the interaction per interaction vector, m (gamma; Moussaid 2009)."""
TURN_SHARPNESS, SLOW_SHARPNESS = 2.0, 3.0
"""Angular sharpness of turning and of slowing down (n and n'; Moussaid 2009)."""
WALL_STRENGTH, WALL_RANGE = 3.0, 0.1
"""Repulsion of a wall at contact, m/s^2, and its range, m (a and b; Moussaid 2009)."""
FAINT_WALL_DISTANCE = 0.6
"""Distance beyond which people do not feel a wall, m."""
BEHIND_WEIGHT, VIEW_COSINE = 0.5, -0.17364817766693033
"""Weight of what lies beyond 100 degrees to either side (c and cos(phi); Helbing & Molnar)."""
GAZE, COHESION, SPACING = 4.0, 3.0, 1.0
"""Strengths within a group (beta_1, beta_2, beta_3; Moussaid 2010)."""
SPACE_IN_GROUP = 0.8
"""Distance below which members of a group repel each other, m (d_0; Moussaid 2010)."""
SIGHT_STEPS = 12
"""Steps in which all pairs of people look at each other once."""
INTERACTION_DISTANCE, FAINT_RANGES = 4.0, 4.0
"""Distance in m, and in ranges of the interaction, beyond which people do not react to each other."""


@njit(cache=True, nogil=True)
def interaction(dx: float, dy: float, vx: float, vy: float) -> tuple[float, float]:
    """Return the acceleration that another person causes (Moussaid 2009).

    dx, dy: vector to the other. vx, vy: own velocity minus that of the other.
    """
    d = max(math.sqrt(dx * dx + dy * dy), 1e-6)
    ex, ey = dx / d, dy / d
    # Interaction vector: relative velocity and direction; its length sets the range.
    tx, ty = VELOCITY_SHARE * vx + ex, VELOCITY_SHARE * vy + ey
    length = math.sqrt(tx * tx + ty * ty)
    if length < 1e-6:
        return 0.0, 0.0
    tx, ty, reach = tx / length, ty / length, RANGE_FACTOR * length
    # Angle from the interaction vector to the other; who comes head on is passed on the left.
    theta = bearing(tx * ex + ty * ey, tx * ey - ty * ex)
    side = 1.0 if theta >= 0.0 else -1.0
    slow = SLOW_SHARPNESS * reach * theta
    turn = TURN_SHARPNESS * reach * theta
    along = -STRENGTH * exp_minus(d / reach + slow * slow)
    across = -STRENGTH * side * exp_minus(d / reach + turn * turn)
    return along * tx - across * ty, along * ty + across * tx


@njit(cache=True, nogil=True)
def is_faint(dx: float, dy: float, vx: float, vy: float) -> bool:
    """Return whether the interaction is negligible, below 2 % of its strength."""
    square = dx * dx + dy * dy
    if square > INTERACTION_DISTANCE * INTERACTION_DISTANCE:
        return True
    # |lambda v + e|^2 = (lambda v)^2 + 2 lambda v e + 1.
    d = math.sqrt(square)
    if d < 1e-6:
        return False
    speed_square = VELOCITY_SHARE * VELOCITY_SHARE * (vx * vx + vy * vy)
    length_square = speed_square + 2.0 * VELOCITY_SHARE * (vx * dx + vy * dy) / d + 1.0
    reach = FAINT_RANGES * RANGE_FACTOR
    return square > reach * reach * length_square


@njit(cache=True, nogil=True)
def look_at_each_other(
    position: Floats, distance: Field, frame: Floats, number: int, sees: NDArray[np.bool_]
) -> None:
    """Update which pairs of people have nothing between them, a part of the pairs in each step `number`."""
    n = len(position)
    for i in range(n):
        x, y = position[i, 0], position[i, 1]
        for j in range(i + 1 + (number + 2 * i) % SIGHT_STEPS, n, SIGHT_STEPS):
            px, py = position[j, 0], position[j, 1]
            near = (px - x) ** 2 + (py - y) ** 2 < INTERACTION_DISTANCE * INTERACTION_DISTANCE
            sees[i, j] = near and is_visible(distance, frame, x, y, px, py)
            sees[j, i] = sees[i, j]


@njit(cache=True, nogil=True)
def force_of_people(
    position: Floats, velocity: Floats, heading: Floats, sees: NDArray[np.bool_], i: int
) -> tuple[float, float]:
    """Return the acceleration of person i by all others in sight."""
    fx, fy = 0.0, 0.0
    x, y, vx, vy = position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1]
    for j in range(len(position)):
        if not sees[i, j]:
            continue
        dx, dy = position[j, 0] - x, position[j, 1] - y
        wx, wy = vx - velocity[j, 0], vy - velocity[j, 1]
        if not is_faint(dx, dy, wx, wy):
            ax, ay = interaction(dx, dy, wx, wy)
            weight = weight_of_view(heading[i, 0], heading[i, 1], dx, dy)
            fx, fy = fx + weight * ax, fy + weight * ay
    return fx, fy


@njit(cache=True, nogil=True)
def force_of_robot(w: Walkers, s: Surroundings, i: int) -> tuple[float, float]:
    """Return the acceleration of person i by the robot as people see it."""
    (x, y), (vx, vy), seen = w.position[i], w.velocity[i], s.seen
    dx, dy = seen[0] - x, seen[1] - y
    vx, vy = vx - seen[2], vy - seen[3]
    if dx * dx + dy * dy > s.sight * s.sight or is_faint(dx, dy, vx, vy):
        return 0.0, 0.0
    if not is_visible(s.distance, s.frame, x, y, seen[0], seen[1]):
        return 0.0, 0.0
    ax, ay = interaction(dx, dy, vx, vy)
    weight = weight_of_view(w.heading[i, 0], w.heading[i, 1], dx, dy)
    return weight * ax, weight * ay


@njit(cache=True, nogil=True)
def weight_of_view(hx: float, hy: float, dx: float, dy: float) -> float:
    """Return the weight of what lies at (dx, dy) for who looks along (hx, hy); Helbing & Molnar, equation (7)."""
    in_view = dx * hx + dy * hy >= VIEW_COSINE * math.sqrt(dx * dx + dy * dy)
    return 1.0 if in_view else BEHIND_WEIGHT


@njit(cache=True, nogil=True)
def force_of_walls(distance: Field, frame: Floats, x: float, y: float, radius: float) -> tuple[float, float]:
    """Return the acceleration by walls and furniture."""
    free = distance_at(distance, frame, x, y) - radius
    if free > FAINT_WALL_DISTANCE:
        return 0.0, 0.0
    ux, uy = away_from_obstacle(distance, frame, x, y)
    push = WALL_STRENGTH * exp_minus(max(free, 0.0) / WALL_RANGE)
    return push * ux, push * uy


@njit(cache=True, nogil=True)
def force_of_movers(leaves: Floats, discs: Floats, x: float, y: float, radius: float) -> tuple[float, float]:
    """Return the acceleration by door leaves and chairs."""
    fx, fy = 0.0, 0.0
    for k in range(len(leaves)):
        px, py = nearest_on_leaf(leaves, k, x, y)
        ax, ay = _repulsion(x - px, y - py, radius)
        fx, fy = fx + ax, fy + ay
    for k in range(len(discs)):
        ax, ay = _repulsion(x - discs[k, 0], y - discs[k, 1], radius + discs[k, 2])
        fx, fy = fx + ax, fy + ay
    return fx, fy


@njit(cache=True, nogil=True)
def _repulsion(dx: float, dy: float, radius: float) -> tuple[float, float]:
    square = dx * dx + dy * dy
    if square < 1e-12 or square > (radius + FAINT_WALL_DISTANCE) ** 2:
        return 0.0, 0.0
    distance = math.sqrt(square)
    push = WALL_STRENGTH * exp_minus(max(distance - radius, 0.0) / WALL_RANGE) / distance
    return push * dx, push * dy


@njit(cache=True, nogil=True)
def nearest_on_leaf(leaves: Floats, k: int, x: float, y: float) -> tuple[float, float]:
    """Return the point of leaf k nearest to (x, y)."""
    ax, ay = leaves[k, 0], leaves[k, 1]
    dx, dy = leaves[k, 2] - ax, leaves[k, 3] - ay
    t = ((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-12)
    t = min(max(t, 0.0), 1.0)
    return ax + t * dx, ay + t * dy


@njit(cache=True, nogil=True)
def force_of_group(
    position: Floats, velocity: Floats, heading: Floats, group: NDArray[np.int64], i: int
) -> tuple[float, float]:
    """Return the acceleration that keeps person i, who is in a group, with the others (Moussaid 2010)."""
    x, y = position[i, 0], position[i, 1]
    fx, fy, sx, sy, others = 0.0, 0.0, 0.0, 0.0, 0
    for j in range(len(position)):
        if j == i or group[j] != group[i]:
            continue
        dx, dy = position[j, 0] - x, position[j, 1] - y
        sx, sy, others = sx + dx, sy + dy, others + 1
        # Members keep some space between each other.
        distance = max(math.sqrt(dx * dx + dy * dy), 1e-6)
        if distance < SPACE_IN_GROUP:
            fx, fy = fx - SPACING * dx / distance, fy - SPACING * dy / distance
    if others == 0:
        return 0.0, 0.0
    # Gaze: who must turn the head beyond 90 degrees to see the others slows down.
    mx, my, hx, hy = sx / others, sy / others, heading[i, 0], heading[i, 1]
    turn = abs(bearing(hx * mx + hy * my, hx * my - hy * mx)) - 0.5 * PI
    if turn > 0.0:
        fx, fy = fx - GAZE * turn * velocity[i, 0], fy - GAZE * turn * velocity[i, 1]
    # Cohesion: towards the centre of the group beyond (N - 1) / 2 metres.
    cx, cy = sx / (others + 1), sy / (others + 1)
    distance = math.sqrt(cx * cx + cy * cy)
    if distance > 0.5 * others:
        fx, fy = fx + COHESION * cx / distance, fy + COHESION * cy / distance
    return fx, fy


@njit(cache=True, nogil=True)
def driving_force(vx: float, vy: float, ex: float, ey: float, speed: float) -> tuple[float, float]:
    """Return the acceleration from (vx, vy) to `speed` along the unit vector (ex, ey); Helbing & Molnar, (2)."""
    return (speed * ex - vx) / RELAXATION, (speed * ey - vy) / RELAXATION
