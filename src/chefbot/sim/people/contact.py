"""Steps that bring nobody into a wall, a chair, a door leaf, the robot or another person."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.sim.people.distance_field import Field, Floats, away_from_obstacle, distance_at
from chefbot.sim.people.forces import nearest_on_leaf
from chefbot.sim.people.walkers import Surroundings, Walkers
from chefbot.sim.world.furniture import PERSON_RADIUS

LEAF_GAP = 0.04
"""Metres that a body keeps to the centre line of a door leaf."""
ROBOT_GAP, SHY_GAP = 0.025, 0.16
"""Metres at which a person stops in front of the robot, and one who avoids it."""
BRAKING_TIME = 0.4
"""Time constant with which a person who avoids the robot brakes before it, s."""
LARGEST_STEP = 0.2
"""Bound of the distance that a person walks in a step, m."""


@njit(cache=True, nogil=True)
def admissible_step(
    w: Walkers, s: Surroundings, i: int, dx: float, dy: float, duration: float, near: NDArray[np.int64]
) -> tuple[float, float]:
    """Return the part of the step (dx, dy) of person i that brings it into nothing.

    What leads into an obstacle is taken off along its normal; if corners leave nothing allowed, the person stays.
    near: (n,) memory for the numbers of the people near by.
    """
    x, y = w.position[i, 0], w.position[i, 1]
    near = near[: _find_near(w.position, i, x, y, near)]
    gap, share = ROBOT_GAP, 1.0
    if w.shy[i]:
        gap, share = SHY_GAP, min(duration / BRAKING_TIME, 1.0)
    reach = PERSON_RADIUS + s.robot[2]
    # Again if something was taken off: the rest may lead into another obstacle.
    for _ in range(2):
        ox, oy = dx, dy
        dx, dy = _off_walls(s.distance, s.frame, x, y, dx, dy)
        dx, dy = _off_people(w.position, near, x, y, dx, dy)
        dx, dy = _off_disc(x, y, s.robot[0], s.robot[1], reach + gap, share, dx, dy)
        dx, dy = _off_movers(s.leaves, s.discs, x, y, dx, dy)
        if dx == ox and dy == oy:
            break
    clear = (
        _clear_of_walls(s.distance, s.frame, x, y, dx, dy)
        and _clear_of_people(w.position, near, x, y, dx, dy)
        and not _comes_nearer(x, y, dx, dy, s.robot[0], s.robot[1], reach + ROBOT_GAP)
        and _clear_of_movers(s.leaves, s.discs, x, y, dx, dy)
    )
    return (dx, dy) if clear else (0.0, 0.0)


@njit(cache=True, nogil=True)
def _off_walls(
    distance: Field, frame: Floats, x: float, y: float, dx: float, dy: float
) -> tuple[float, float]:
    """Return the step without what brings a body nearer to a wall than it may."""
    if distance_at(distance, frame, x + dx, y + dy) >= PERSON_RADIUS:
        return dx, dy
    ux, uy = away_from_obstacle(distance, frame, x, y)
    inward = -(dx * ux + dy * uy)
    allowed = max(distance_at(distance, frame, x, y) - PERSON_RADIUS, 0.0)
    if inward > allowed:
        return dx + (inward - allowed) * ux, dy + (inward - allowed) * uy
    return dx, dy


@njit(cache=True, nogil=True)
def _find_near(position: Floats, i: int, x: float, y: float, near: NDArray[np.int64]) -> int:
    """Write the numbers of the people that person i may reach in a step, and return how many there are."""
    count = 0
    for j in range(len(position)):
        square = (position[j, 0] - x) ** 2 + (position[j, 1] - y) ** 2
        if j != i and square < (2.0 * PERSON_RADIUS + LARGEST_STEP) ** 2:
            near[count] = j
            count += 1
    return count


@njit(cache=True, nogil=True)
def _off_people(
    position: Floats, near: NDArray[np.int64], x: float, y: float, dx: float, dy: float
) -> tuple[float, float]:
    """Return the step without what brings a person into others."""
    for j in near:
        dx, dy = _off_disc(x, y, position[j, 0], position[j, 1], 2.0 * PERSON_RADIUS, 1.0, dx, dy)
    return dx, dy


@njit(cache=True, nogil=True)
def _off_movers(
    leaves: Floats, discs: Floats, x: float, y: float, dx: float, dy: float
) -> tuple[float, float]:
    """Return the step without what brings a body into a door leaf or a chair."""
    for k in range(len(leaves)):
        px, py = nearest_on_leaf(leaves, k, x, y)
        dx, dy = _off_disc(x, y, px, py, PERSON_RADIUS + LEAF_GAP, 1.0, dx, dy)
    for k in range(len(discs)):
        dx, dy = _off_disc(x, y, discs[k, 0], discs[k, 1], PERSON_RADIUS + discs[k, 2], 1.0, dx, dy)
    return dx, dy


@njit(cache=True, nogil=True)
def _off_disc(
    x: float, y: float, px: float, py: float, reach: float, share: float, dx: float, dy: float
) -> tuple[float, float]:
    """Return the step from (x, y) without what uses more than `share` of the room left to `reach` from (px, py)."""
    nx, ny = x - px, y - py
    square = nx * nx + ny * ny
    if square < 1e-18 or square > (reach + LARGEST_STEP / share) ** 2:
        return dx, dy
    distance = math.sqrt(square)
    nx, ny = nx / distance, ny / distance
    inward = -(dx * nx + dy * ny)
    allowed = max(distance - reach, 0.0) * share
    if inward > allowed:
        return dx + (inward - allowed) * nx, dy + (inward - allowed) * ny
    return dx, dy


@njit(cache=True, nogil=True)
def _clear_of_walls(distance: Field, frame: Floats, x: float, y: float, dx: float, dy: float) -> bool:
    """Return whether a body at the end of the step is clear of walls, or no deeper in one than before."""
    free = distance_at(distance, frame, x + dx, y + dy)
    return free >= PERSON_RADIUS or free >= distance_at(distance, frame, x, y)


@njit(cache=True, nogil=True)
def _clear_of_people(
    position: Floats, near: NDArray[np.int64], x: float, y: float, dx: float, dy: float
) -> bool:
    """Return whether the step brings a person into nobody."""
    clear = True
    for j in near:
        nearer = _comes_nearer(x, y, dx, dy, position[j, 0], position[j, 1], 2.0 * PERSON_RADIUS)
        clear = clear and not nearer
    return clear


@njit(cache=True, nogil=True)
def _clear_of_movers(leaves: Floats, discs: Floats, x: float, y: float, dx: float, dy: float) -> bool:
    """Return whether the step brings a body into no door leaf and no chair."""
    for k in range(len(leaves)):
        px, py = nearest_on_leaf(leaves, k, x + dx, y + dy)
        if _comes_nearer(x, y, dx, dy, px, py, PERSON_RADIUS + LEAF_GAP):
            return False
    for k in range(len(discs)):
        if _comes_nearer(x, y, dx, dy, discs[k, 0], discs[k, 1], PERSON_RADIUS + discs[k, 2]):
            return False
    return True


@njit(cache=True, nogil=True)
def _comes_nearer(x: float, y: float, dx: float, dy: float, px: float, py: float, reach: float) -> bool:
    """Return whether a step from (x, y) ends within `reach` of (px, py) and nearer than it began."""
    after = (x + dx - px) ** 2 + (y + dy - py) ** 2
    before = (x - px) ** 2 + (y - py) ** 2
    return after < (reach - 1e-9) ** 2 and after < before
