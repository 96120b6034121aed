"""Doors that open and close at a walking pace and stop before they hit somebody."""

from __future__ import annotations

import math
from collections.abc import Sequence

from chefbot.maths.se2 import SE2
from chefbot.sim.world.furniture import door_leaf, door_pose
from chefbot.sim.world.people import Disc
from chefbot.sim.world.shapes import Shape, clearance
from chefbot.sim.world.world_spec import Door

SPEED = 0.5  # of the whole travel per second
GAP = 0.03  # m that a leaf keeps to whoever stands in its way


class MovingDoor:
    """The leaf of one door and how far it is open."""

    def __init__(self, door: Door) -> None:
        self.door = door
        self.leaf = door_leaf(door)
        self.open = self.target = door.open

    @property
    def moving(self) -> bool:
        """Whether it is not yet where it should be."""
        return self.open != self.target

    @property
    def pose(self) -> SE2:
        """The leaf's frame in the world."""
        return door_pose(self.door, self.open)

    @property
    def shape(self) -> Shape:
        """The leaf in the world."""
        return self.leaf.moved(self.pose)

    def advance(self, duration: float, others: Sequence[Disc]) -> bool:
        """Move towards the target unless somebody is in the way; whether the leaf moved."""
        if not self.moving:
            return False
        step = max(-SPEED * duration, min(SPEED * duration, self.target - self.open))
        wanted = self.leaf.moved(door_pose(self.door, self.open + step))
        if any(_hits(wanted, self.shape, other) for other in others):
            return False
        self.open += step
        return True


def _hits(wanted: Shape, now: Shape, other: Disc) -> bool:
    x, y, radius = other
    gap = clearance([wanted], x, y, -math.inf, math.inf)
    return gap < radius + GAP and gap < clearance([now], x, y, -math.inf, math.inf)
