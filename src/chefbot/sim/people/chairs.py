"""Chairs that people pull out and push in."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from numpy.random import Generator

from chefbot.maths.se2 import SE2
from chefbot.sim.people.floor import PeopleFloor
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.shapes import OccupiedCircle, SimulatedShape

CHAIR_NAME = re.compile(r"(^|_)chair_\d+$")
CHAIR_RADIUS = 0.25
"""Radius of the disc that stands for a chair, m."""
TRAVEL = 0.45
"""How far a chair is pulled out, m."""
BEHIND_CHAIR_DISTANCE = 0.62
"""Distance from the middle of a chair to the person who pulls or pushes it, m."""
PULL_SPEED = 0.3
"""Speed of a chair that is pulled or pushed, m/s."""
GAP = 0.03
"""Metres that a chair keeps to the robot and to people."""


class MovableChair:
    """A chair that people move along its own x axis.

    solids: its solids in its place, in the world. shapes: in its own frame. out: metres that it is pulled out; it
    moves until that is `target`.
    """

    def __init__(self, name: str, solids: Sequence[SimulatedShape]) -> None:
        self.name = name
        seat = next(shape for shape in solids if shape.name.endswith("/seat"))
        self.home = SE2(seat.x, seat.y, seat.yaw)
        self.solids = tuple(solids)
        self.shapes = tuple(_in_frame(shape, self.home) for shape in solids)
        self.out = self.target = 0.0

    @property
    def pose(self) -> SE2:
        """Pose in the world, x towards the table."""
        return self.home @ SE2(-self.out, 0.0, 0.0)

    def behind(self, out: float) -> tuple[float, float]:
        """Return where the person stands who has pulled the chair out by `out` metres."""
        place = self.home @ SE2(-out - BEHIND_CHAIR_DISTANCE, 0.0, 0.0)
        return place.x, place.y

    def advance(self, duration: float, others: Sequence[OccupiedCircle]) -> bool:
        """Move towards the target unless somebody is in the way; return whether the chair moved."""
        remaining = self.target - self.out
        if remaining == 0.0:
            return False
        travel = PULL_SPEED * duration
        out = self.target if abs(remaining) <= travel else self.out + math.copysign(travel, remaining)
        after, before = self.home @ SE2(-out, 0.0, 0.0), self.pose
        for x, y, radius in others:
            gap = math.hypot(after.x - x, after.y - y) - CHAIR_RADIUS - radius
            if gap < GAP and gap < math.hypot(before.x - x, before.y - y) - CHAIR_RADIUS - radius:
                return False
        self.out = out
        return True

    def can_be_pulled(self, floor: PeopleFloor) -> bool:
        """Return whether the floor has room behind the chair, which is not on it, for the chair and a person."""
        start = self.home @ SE2(-0.3, 0.0, 0.0)
        end_x, end_y = self.behind(TRAVEL)
        return floor.free(start.x, start.y) > PERSON_RADIUS and floor.is_clear(
            start.x, start.y, end_x, end_y, PERSON_RADIUS + GAP
        )


class ChairTask:
    """A chair that may be used: the destinations behind it, pushed in and pulled out, and who uses it now."""

    user: int | None = None

    def __init__(self, chair: MovableChair, floor: PeopleFloor) -> None:
        self.chair = chair
        self.in_destination = floor.add_destination(*chair.behind(0.0))
        self.out_destination = floor.add_destination(*chair.behind(TRAVEL))


def _in_frame(shape: SimulatedShape, frame: SE2) -> SimulatedShape:
    local = frame.between(SE2(shape.x, shape.y, shape.yaw))
    return shape._replace(x=local.x, y=local.y, yaw=local.yaw)


def chairs_of(solids: Sequence[SimulatedShape]) -> list[MovableChair]:
    """Return the chairs among the solids of a world, which are named "object/part"."""
    parts: dict[str, list[SimulatedShape]] = {}
    for shape in solids:
        name = shape.name.split("/")[0]
        if CHAIR_NAME.search(name):
            parts.setdefault(name, []).append(shape)
    return [MovableChair(name, shapes) for name, shapes in parts.items()]


def choose_chairs(
    solids: Sequence[SimulatedShape], floor: PeopleFloor, rng: Generator, count: int
) -> list[MovableChair]:
    """Choose up to `count` chairs at random that can be pulled out; the others are added to the floor.

    floor: the floor without chairs.
    """
    every = chairs_of(solids)
    chosen: list[MovableChair] = []
    for k in rng.permutation(len(every)).tolist():
        others = [chair for chair in every if chair is not every[k]]
        if len(chosen) < count and every[k].can_be_pulled(floor) and _room_beside(every[k], others):
            chosen.append(every[k])
    floor.add([shape for chair in every if chair not in chosen for shape in chair.solids])
    return chosen


def _room_beside(chair: MovableChair, others: Sequence[MovableChair]) -> bool:
    """Return whether no other chair stands where the chair and its person go, or may be pulled there."""
    mine = [(p.x, p.y) for p in (chair.home @ SE2(-d, 0.0, 0.0) for d in (0.0, 0.3, 0.6, 0.9, 1.1))]
    theirs = [(p.x, p.y) for o in others for p in (o.home, o.home @ SE2(-TRAVEL, 0.0, 0.0))]
    apart = 2.0 * CHAIR_RADIUS
    return all(math.dist(a, b) > apart for a in mine for b in theirs)
