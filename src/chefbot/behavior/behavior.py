"""Interface of a recovery behavior, and its collision check."""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple, Protocol

from chefbot.maths.costs import INSCRIBED, LETHAL, Costmap
from chefbot.maths.se2 import SE2


class BehaviorProgress(Enum):
    """State of a behavior after an update."""

    RUNNING = "running"
    DONE = "done"
    BLOCKED = "something is in the way"
    TIMED_OUT = "it took too long"


class BehaviorStep(NamedTuple):
    """Commanded twist (m/s, rad/s) and the progress of the behavior."""

    v: float
    w: float
    progress: BehaviorProgress


class Behavior(Protocol):
    """Interface of a behavior; a new instance is created for every run."""

    def update(self, pose: SE2, costmap: Costmap, dt: float) -> BehaviorStep:
        """Return the twist for the next `dt` seconds, from the current pose."""


def guarded_step(behavior: Behavior, pose: SE2, costmap: Costmap, dt: float, blind: str) -> BehaviorStep:
    """Update a behavior; while the robot is blind ahead, a step forward becomes standstill, and it is BLOCKED.

    blind: why the robot must not drive forward now, or an empty string.
    """
    step = behavior.update(pose, costmap, dt)
    return BehaviorStep(0.0, step.w, BehaviorProgress.BLOCKED) if blind and step.v > 0.0 else step


def free_ahead(costmap: Costmap, pose: SE2, distance: float) -> bool:
    """Return whether the robot can drive straight by `distance` metres (negative: backwards) without a collision.

    From within the inscribed zone it may drive as long as it meets no lethal cell and does not enter that zone again.
    Unknown cells are not free. A polygonal footprint may move away from what it touches, and along it.
    """
    steps = max(1, math.ceil(abs(distance) / (costmap.resolution / 2)))
    poses = [pose @ SE2(distance * i / steps, 0.0, 0.0) for i in range(steps + 1)]
    if costmap.comes_nearer(poses):
        return False
    previous = costmap.at(pose.x, pose.y)
    for ahead in poses[1:]:
        cost = costmap.at(ahead.x, ahead.y)
        if cost >= LETHAL or (cost >= INSCRIBED and previous < INSCRIBED):
            return False
        previous = cost
    return True
