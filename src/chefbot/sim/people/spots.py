"""Doorways and corners, found by rays over the floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.random import Generator

from chefbot.maths.se2 import SE2
from chefbot.sim.people.distance_field import (
    Field,
    Floats,
    away_from_obstacle,
    distance_at,
    free_range,
    line_is_clear,
)
from chefbot.sim.people.floor import DIGITS, PeopleFloor
from chefbot.sim.world.doors import MovingDoor
from chefbot.sim.world.furniture import PERSON_RADIUS

_STEPS = ((1, 0), (2, 1), (1, 1), (1, 2))
DIRECTIONS = np.array(
    [
        (c * x - s * y, s * x + c * y) / np.sqrt(x * x + y * y)
        for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))
        for x, y in _STEPS
    ]
)
"""Sixteen unit vectors (16, 2) all around, counter-clockwise, from square roots only."""
DOORWAY_WIDTH = (0.55, 1.6)
"""Widths of a passage that counts as a doorway, m."""
MIN_WIDENING, WIDENING_DISTANCE, ROOM_BEHIND = 0.6, 0.7, 1.0
"""A doorway is narrower by this than the floor at this distance on both sides, which is this deep; m."""
HIDING_DISTANCES = (0.26, 0.5)
"""Distances to the wall at which a person hides behind a corner, m."""
MAX_CORNER_DISTANCE, CORNER_DEPTH = 0.9, 1.5
"""Largest distance to the edge of a corner, and the least depth of the floor behind it, m."""
PAST_WALL_DISTANCE = 0.3
"""Distance behind the front of the nearest wall that is seen past its edge, m; along a wall without an edge nothing
is."""
OUT_DISTANCE = 0.6
"""Distance beyond the edge to which a person steps out, m."""
OUT_DIRECTIONS = 3
"""Directions in which it may do so, from that past the edge on away from the wall."""


class DoorwaySpot(NamedTuple):
    """The middle of a doorway and the unit vector (ux, uy) through it."""

    x: float
    y: float
    ux: float
    uy: float


class HidingPlace(NamedTuple):
    """A place beside a corner, and the point (out_x, out_y) beyond the corner."""

    x: float
    y: float
    out_x: float
    out_y: float


def doorways(floor: PeopleFloor, rng: Generator, count: int) -> list[DoorwaySpot]:
    """Return up to `count` doorways in random order, at least a metre apart."""
    points = _points(floor)
    through = np.zeros((len(points), 2))
    _find_doorways(floor.distance, floor.frame, points, DIRECTIONS, through)
    found = np.flatnonzero(through.any(axis=1))
    chosen: list[DoorwaySpot] = []
    for k in rng.permutation(found).tolist():
        spot = DoorwaySpot(*points[k].tolist(), *through[k].tolist())
        if len(chosen) < count and all(math.dist(spot[:2], other[:2]) > 1.0 for other in chosen):
            chosen.append(spot)
    return chosen


def hiding_places(floor: PeopleFloor, rng: Generator, count: int) -> list[HidingPlace]:
    """Return up to `count` places beside corners in random order, at least a metre apart."""
    points = _points(floor)
    out = np.zeros((len(points), 2))
    _find_corners(floor.distance, floor.frame, points, DIRECTIONS, out)
    chosen: list[HidingPlace] = []
    for k in rng.permutation(np.flatnonzero(out.any(axis=1))).tolist():
        if len(chosen) == count:
            break
        x, y = points[k].tolist()
        if all(math.dist((x, y), other[:2]) > 1.0 for other in chosen):
            chosen.append(HidingPlace(x, y, *out[k].tolist()))
    return chosen


def door_sides(floor: PeopleFloor, doors: Sequence[MovingDoor]) -> list[tuple[MovingDoor, float, float]]:
    """Return each door with a point before it, clear of the swing of its leaf, if there is one on the floor."""
    sides = []
    for moving in doors:
        door = moving.door
        # A leaf swings to the side of its angle: rather stand on the other one.
        away = -math.copysign(1.0, door.swing)
        for y in (0.6 * away, -0.6 * away if door.kind == "slide" else -(door.width + 0.4) * away):
            place = door.pose @ SE2(0.5 * door.width, y, 0.0)
            if floor.free(place.x, place.y) > PERSON_RADIUS + 0.05:
                sides.append((moving, round(place.x, DIGITS), round(place.y, DIGITS)))
                break
    return sides


def _points(floor: PeopleFloor) -> Floats:
    x0, y0, cell = floor.path_frame.tolist()
    return np.column_stack([x0 + (floor.cells[:, 1] + 0.5) * cell, y0 + (floor.cells[:, 0] + 0.5) * cell])


@njit(cache=True, nogil=True)
def _find_doorways(field: Field, frame: Floats, points: Floats, directions: Floats, through: Floats) -> None:
    """Write the direction through the doorway at each point (n, 2); (0, 0) where there is none."""
    for k in range(len(points)):
        x, y = points[k]
        if not 0.5 * DOORWAY_WIDTH[0] <= distance_at(field, frame, x, y) <= 0.5 * DOORWAY_WIDTH[1]:
            continue
        for n in range(8):
            # Across: u; through: v, a quarter turn on.
            ux, uy = directions[n]
            vx, vy = -uy, ux
            left = free_range(field, frame, x, y, ux, uy, DOORWAY_WIDTH[1])
            right = free_range(field, frame, x, y, -ux, -uy, DOORWAY_WIDTH[1])
            width = left + right
            if abs(left - right) > 0.15 or not DOORWAY_WIDTH[0] <= width <= DOORWAY_WIDTH[1]:
                continue
            if _opens(field, frame, x, y, vx, vy, width) and _opens(field, frame, x, y, -vx, -vy, width):
                through[k, 0], through[k, 1] = vx, vy
                break


@njit(cache=True, nogil=True)
def _opens(field: Field, frame: Floats, x: float, y: float, vx: float, vy: float, width: float) -> bool:
    """Return whether the floor gets wider along (vx, vy)."""
    if free_range(field, frame, x, y, vx, vy, ROOM_BEHIND) < ROOM_BEHIND:
        return False
    x, y = x + WIDENING_DISTANCE * vx, y + WIDENING_DISTANCE * vy
    limit = width + MIN_WIDENING
    left = free_range(field, frame, x, y, -vy, vx, limit)
    return left + free_range(field, frame, x, y, vy, -vx, limit) >= limit


@njit(cache=True, nogil=True)
def _find_corners(field: Field, frame: Floats, points: Floats, directions: Floats, out: Floats) -> None:
    """Write the point beyond a corner beside each point (n, 2); (0, 0) where there is none."""
    count = len(directions)
    ranges = np.empty(count)
    for k in range(len(points)):
        x, y = points[k]
        wall = distance_at(field, frame, x, y)
        if not HIDING_DISTANCES[0] <= wall <= HIDING_DISTANCES[1]:
            continue
        wx, wy = away_from_obstacle(field, frame, x, y)
        for n in range(count):
            ranges[n] = free_range(
                field, frame, x, y, directions[n, 0], directions[n, 1], MAX_CORNER_DISTANCE + CORNER_DEPTH
            )
        # An edge: a near range beside a far one, on either side.
        for n in range(2 * count):
            turn = 1 if n < count else -1
            near, far = n % count, (n + turn) % count
            past_wall = -ranges[far] * (wx * directions[far, 0] + wy * directions[far, 1]) - wall
            is_edge = ranges[near] < MAX_CORNER_DISTANCE and ranges[far] > ranges[near] + CORNER_DEPTH
            if is_edge and past_wall >= PAST_WALL_DISTANCE:
                turns = [(far + more * turn) % count for more in range(OUT_DIRECTIONS)]
                if _step_out(
                    field, frame, x, y, ranges[near] + OUT_DISTANCE, directions[np.array(turns)], out[k]
                ):
                    break


@njit(cache=True, nogil=True)
def _step_out(
    field: Field, frame: Floats, x: float, y: float, reach: float, directions: Floats, out: Floats
) -> bool:
    """Write the first point at a distance in one of the directions to which a person can walk straight on."""
    for n in range(len(directions)):
        px, py = x + reach * directions[n, 0], y + reach * directions[n, 1]
        if line_is_clear(field, frame, x, y, px, py, PERSON_RADIUS):
            out[0], out[1] = px, py
            return True
    return False
