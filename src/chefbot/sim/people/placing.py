"""Where people stand at first."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from chefbot.errors import UserError
from chefbot.sim.people.floor import PeopleFloor, Point
from chefbot.sim.people.walkers import Floats
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.shapes import OccupiedCircle

PERSONAL_SPACE = 0.3
"""Metres between people, and to the robot, when they are placed."""
GROUP_REACH = 1.5
"""Distance of the members of a group to the first of them, m."""
ATTEMPTS = 200


def place_people(
    floor: PeopleFloor,
    occupied: Sequence[OccupiedCircle],
    leaders: Sequence[int | None],
    rngs: Sequence[Generator],
) -> Floats:
    """Return free positions (n, 2); leaders: for each person the one whose group it belongs to, or None.

    occupied: where the robot and chairs stand. Raises UserError if there is no room.
    """
    positions: list[Point] = []
    for i, (leader, rng) in enumerate(zip(leaders, rngs, strict=True)):
        circles = [*occupied, *((x, y, PERSON_RADIUS) for x, y in positions)]
        near = None if leader is None else positions[leader]
        positions.append(_place(floor, circles, near, rng, i))
    return np.array(positions, dtype=np.float64).reshape(-1, 2)


def _place(
    floor: PeopleFloor, circles: Sequence[OccupiedCircle], near: Point | None, rng: Generator, number: int
) -> Point:
    for attempt in range(ATTEMPTS if len(floor.cells) else 0):
        x, y = floor.draw_point(rng)
        if near is not None and attempt < ATTEMPTS // 2:
            # A member of a group: a point of the square around the first one.
            x, y = (c + float(rng.uniform(-GROUP_REACH, GROUP_REACH)) for c in near)
            if not floor.is_clear(*near, x, y, PERSON_RADIUS):
                continue
        gap = min((math.dist((x, y), (px, py)) - radius for px, py, radius in circles), default=math.inf)
        if gap > PERSON_RADIUS + PERSONAL_SPACE and floor.fits(x, y):
            return x, y
    raise UserError(f"there is no room for person {number + 1} in this world; reduce the number of people")
