"""What a global planner takes, gives and says when it cannot."""

from __future__ import annotations

from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2


class Failure(Enum):
    """Why there is no path, named as in nav2_msgs/ComputePathToPose, each with its sentence."""

    START_OUTSIDE_MAP = "the start lies outside the map"
    GOAL_OUTSIDE_MAP = "the goal lies outside the map"
    START_OCCUPIED = "the robot stands inside an obstacle and no free cell is near enough to escape to"
    GOAL_OCCUPIED = "the goal and everything within tolerance of it is occupied or unknown"
    NO_VALID_PATH = "no way leads from the start to the goal or to anything within tolerance of it"


class PlanningError(Exception):
    """No path; `failure` names the kind, the text is a sentence with the place."""

    def __init__(self, failure: Failure, where: SE2) -> None:
        super().__init__(f"{failure.value} (at x {where.x:.2f} m, y {where.y:.2f} m)")
        self.failure = failure


class Planner(Protocol):
    """A global planner; name one of your own as `pkg.module:Class` in the launch file."""

    def plan(self, costmap: Costmap, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Poses (n, 3) x, y, yaw from start to goal in the costmap's frame; raises PlanningError."""

    def potential(self, costmap: Costmap, start: SE2) -> NDArray[np.float32]:
        """Cost-to-come of every cell (h, w) in metres of free driving; inf where no way leads."""
