"""Doors that open and close at walking speed and stop before they hit somebody."""

from __future__ import annotations

import math
from collections.abc import Sequence

from chefbot.buildings.world_file import Door
from chefbot.maths.se2 import SE2
from chefbot.sim.world.furniture import door_leaf, door_pose
from chefbot.sim.world.shapes import OccupiedCircle, SimulatedShape, clearance

SPEED = 0.5  # share of the full travel per second
GAP = 0.03  # m that a leaf keeps to a person or the robot


def closed_middle(door: Door) -> SE2:
    """Return the middle of the opening that a door closes, x along the passage through it, in the world frame."""
    return door_pose(door, 0.0) @ SE2(0.5 * door.width, 0.0, 0.5 * math.pi)


class MovingDoor:
    """A door's leaf and its opening, 0 closed .. 1 open."""

    def __init__(self, door: Door) -> None:
        self.door = door
        self.leaf = door_leaf(door)
        self.open = self.target = door.open

    @property
    def moving(self) -> bool:
        """Whether the door has not reached its target yet."""
        return self.open != self.target

    @property
    def pose(self) -> SE2:
        """Pose of the leaf's frame in the world."""
        return door_pose(self.door, self.open)

    @property
    def shape(self) -> SimulatedShape:
        """The leaf's solid in the world."""
        return self.leaf.transformed(self.pose)

    def advance(self, duration: float, others: Sequence[OccupiedCircle]) -> bool:
        """Move towards the target unless somebody is in the way; return whether the leaf moved."""
        if not self.moving:
            return False
        next_open = self._open_after(SPEED * duration)
        next_leaf = self.leaf.transformed(door_pose(self.door, next_open))
        if any(_hits(next_leaf, self.shape, other) for other in others):
            return False
        self.open = next_open
        return True

    def _open_after(self, travel: float) -> float:
        """Return the opening after a travel of at most `travel`, 0..1: exactly the target once it is reached."""
        remaining = self.target - self.open
        return self.target if abs(remaining) <= travel else self.open + math.copysign(travel, remaining)


def _hits(next_leaf: SimulatedShape, leaf: SimulatedShape, other: OccupiedCircle) -> bool:
    x, y, radius = other
    gap = clearance([next_leaf], x, y, -math.inf, math.inf)
    return gap < radius + GAP and gap < clearance([leaf], x, y, -math.inf, math.inf)
