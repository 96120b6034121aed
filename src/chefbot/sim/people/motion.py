"""One step of all people: where each wants to go, the forces on it, and the step that touches nothing."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chefbot.sim.people.contact import admissible_step
from chefbot.sim.people.forces import (
    driving_force,
    force_of_group,
    force_of_movers,
    force_of_people,
    force_of_robot,
    force_of_walls,
    look_at_each_other,
)
from chefbot.sim.people.navigation_functions import next_point
from chefbot.sim.people.walkers import STAND, WALK, Surroundings, Walkers
from chefbot.sim.world.furniture import PERSON_RADIUS

MAX_SPEED_FACTOR = 1.3
"""Highest speed per wanted speed (v_max; Helbing & Molnar)."""
ARRIVAL_TIME = 0.5
"""Time in which people stop at their aim, s."""
FORCE_STEPS = 2
"""Steps for which a force is kept."""
LOOK_STEPS, NEAR_COURSE_DISTANCE = 6, 0.3
"""Steps after which people look for their path again; distance to its next point at which they do at once, m."""
TURNING_SHARE = 0.25
"""Share of the angle to the direction of motion by which the heading turns in a step."""
STUCK_SHARE = 0.15
"""Share of the wanted speed below which a person does not get on."""


@njit(cache=True, nogil=True)
def step(w: Walkers, s: Surroundings, duration: float, number: int) -> None:
    """Advance all people by `duration` s. People who overlap nothing before do not overlap anything after.

    number: count of the steps before; people look for their path in turn.
    """
    n = len(w.pace)
    wanted, near = np.zeros((n, 2)), np.empty(n, np.int64)
    look_at_each_other(w.position, s.distance, s.frame, number, w.sees)
    # Forces from the same instant, of half of the people in each step.
    for i in range(n):
        if w.mode[i] != STAND:
            _look_for_path(w, s, i, (number + i) % LOOK_STEPS == 0)
            if (number + i) % FORCE_STEPS == 0:
                w.force[i] = _force(w, s, i)
            wanted[i] = _wanted_velocity(w, i, duration)
    # Steps one after the other, each against the positions at its time.
    for i in range(n):
        dx, dy = wanted[i, 0] * duration, wanted[i, 1] * duration
        if w.mode[i] != STAND:
            dx, dy = admissible_step(w, s, i, dx, dy, duration, near)
        w.position[i, 0] += dx
        w.position[i, 1] += dy
        w.velocity[i, 0], w.velocity[i, 1] = dx / duration, dy / duration
        _turn(w, i)
        _count_stuck(w, i, duration)


@njit(cache=True, nogil=True)
def _look_for_path(w: Walkers, s: Surroundings, i: int, due: bool) -> None:
    """Find the next point on the path of person i if it is due or near the last one."""
    if w.mode[i] != WALK:
        w.course[i] = w.aim[i]
        return
    dx, dy = w.course[i, 0] - w.position[i, 0], w.course[i, 1] - w.position[i, 1]
    if due or dx * dx + dy * dy < NEAR_COURSE_DISTANCE * NEAR_COURSE_DISTANCE:
        x, y, costs = w.position[i, 0], w.position[i, 1], s.path_costs[w.destination[i]]
        px, py = next_point(costs, s.path_frame, s.distance, s.frame, x, y, PERSON_RADIUS)
        w.course[i, 0], w.course[i, 1] = px, py


@njit(cache=True, nogil=True)
def _force(w: Walkers, s: Surroundings, i: int) -> tuple[float, float]:
    """Return the sum of the forces on person i."""
    (x, y), (vx, vy) = w.position[i], w.velocity[i]
    ex, ey, speed = _course(w, i)
    fx, fy = driving_force(vx, vy, ex, ey, speed)
    ax, ay = force_of_people(w.position, w.velocity, w.heading, w.sees, i)
    bx, by = force_of_walls(s.distance, s.frame, x, y, PERSON_RADIUS)
    cx, cy = force_of_movers(s.leaves, s.discs, x, y, PERSON_RADIUS)
    fx, fy = fx + ax + bx + cx, fy + ay + by + cy
    if w.group[i] >= 0:
        ax, ay = force_of_group(w.position, w.velocity, w.heading, w.group, i)
        fx, fy = fx + ax, fy + ay
    if w.shy[i]:
        ax, ay = force_of_robot(w, s, i)
        fx, fy = fx + ax, fy + ay
    return fx, fy


@njit(cache=True, nogil=True)
def _wanted_velocity(w: Walkers, i: int, duration: float) -> tuple[float, float]:
    """Return the velocity that the force gives to person i, bounded; Helbing & Molnar, equations (11) and (12)."""
    vx, vy = w.velocity[i, 0] + w.force[i, 0] * duration, w.velocity[i, 1] + w.force[i, 1] * duration
    limit = MAX_SPEED_FACTOR * w.pace[i]
    length = math.sqrt(vx * vx + vy * vy)
    if length > limit:
        vx, vy = vx * limit / length, vy * limit / length
    return vx, vy


@njit(cache=True, nogil=True)
def _course(w: Walkers, i: int) -> tuple[float, float, float]:
    """Return the unit vector to the next point of the path and the speed there."""
    x, y = w.position[i, 0], w.position[i, 1]
    dx, dy = w.course[i, 0] - x, w.course[i, 1] - y
    distance = math.sqrt(dx * dx + dy * dy)
    if distance < 1e-3:
        return 0.0, 0.0, 0.0
    distance_left = math.sqrt((w.aim[i, 0] - x) ** 2 + (w.aim[i, 1] - y) ** 2)
    return dx / distance, dy / distance, min(w.pace[i], distance_left / ARRIVAL_TIME)


@njit(cache=True, nogil=True)
def _turn(w: Walkers, i: int) -> None:
    """Turn person i towards its motion or, standing, towards its aim."""
    tx, ty = w.velocity[i, 0], w.velocity[i, 1]
    if w.mode[i] == STAND:
        tx, ty = w.aim[i, 0] - w.position[i, 0], w.aim[i, 1] - w.position[i, 1]
    length = math.sqrt(tx * tx + ty * ty)
    if length < 0.05:
        return
    hx, hy = w.heading[i, 0], w.heading[i, 1]
    tx, ty = tx / length, ty / length
    # Who has to turn round turns to the left.
    if hx * tx + hy * ty < -0.9:
        tx, ty = -hy, hx
    hx, hy = hx + TURNING_SHARE * (tx - hx), hy + TURNING_SHARE * (ty - hy)
    length = math.sqrt(hx * hx + hy * hy)
    w.heading[i, 0], w.heading[i, 1] = hx / length, hy / length


@njit(cache=True, nogil=True)
def _count_stuck(w: Walkers, i: int, duration: float) -> None:
    """Count the time for which person i has not got on."""
    speed = math.sqrt(w.velocity[i, 0] ** 2 + w.velocity[i, 1] ** 2)
    if w.mode[i] == STAND:
        w.stuck[i] = 0.0
    elif speed < STUCK_SHARE * w.pace[i]:
        w.stuck[i] += duration
    else:
        w.stuck[i] = max(w.stuck[i] - 2.0 * duration, 0.0)
