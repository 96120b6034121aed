"""What a recovery behaviour takes and gives."""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple, Protocol

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2


class Progress(Enum):
    """How a behaviour fares."""

    RUNNING = "running"
    DONE = "done"
    BLOCKED = "something is in the way"
    TIMED_OUT = "it took too long"


class Step(NamedTuple):
    """Twist (m/s, rad/s) and how things stand."""

    v: float
    w: float
    progress: Progress


class Behavior(Protocol):
    """A behaviour; a new one is made for every run."""

    def update(self, pose: SE2, costmap: Costmap, dt: float) -> Step:
        """The twist for the next `dt` seconds, from the pose now."""


def cost_at(costmap: Costmap, x: float, y: float) -> int:
    """Cost at the point; outside and unknown count as UNKNOWN."""
    row = math.floor((y - costmap.origin_y) / costmap.resolution)
    column = math.floor((x - costmap.origin_x) / costmap.resolution)
    h, w = costmap.cells.shape
    return int(costmap.cells[row, column]) if 0 <= row < h and 0 <= column < w else UNKNOWN


def free_ahead(costmap: Costmap, pose: SE2, distance: float) -> bool:
    """Whether the disk can go straight by `distance` metres (negative: backwards) without touching anything.

    Out of the inscribed zone it may go as long as it meets nothing lethal and the cost does not rise.
    Unknown is not free.
    """
    steps = max(1, math.ceil(abs(distance) / (costmap.resolution / 2)))
    last = cost_at(costmap, pose.x, pose.y)
    for i in range(1, steps + 1):
        d = distance * i / steps
        cost = cost_at(costmap, pose.x + d * math.cos(pose.yaw), pose.y + d * math.sin(pose.yaw))
        if cost >= LETHAL or (cost >= INSCRIBED and last < INSCRIBED):
            return False
        last = cost
    return True
