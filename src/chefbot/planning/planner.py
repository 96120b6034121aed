"""Interface of a global planner and its errors."""

from __future__ import annotations

from enum import Enum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ChefbotError
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2


class PlanningFailure(Enum):
    """Reasons why no path was found, named as in nav2_msgs/ComputePathToPose, with their messages."""

    START_OUTSIDE_MAP = "the start lies outside the map"
    GOAL_OUTSIDE_MAP = "the goal lies outside the map"
    START_OCCUPIED = "the robot stands inside an obstacle, and nothing near it is free"
    GOAL_OCCUPIED = "the goal and everything near it is occupied or unknown"
    NO_VALID_PATH = "no path leads to the goal"


OUTSIDE_MAP = (PlanningFailure.START_OUTSIDE_MAP, PlanningFailure.GOAL_OUTSIDE_MAP)
"""Failures whose message contains the position: it is not visible on the map."""


class PlanningError(ChefbotError):
    """Raised when no path was found; `failure` is the reason."""

    def __init__(self, failure: PlanningFailure, where: SE2) -> None:
        position = f" (at x {where.x:.2f} m, y {where.y:.2f} m)" if failure in OUTSIDE_MAP else ""
        super().__init__(f"{failure.value}{position}")
        self.failure = failure


class InvalidPathError(ChefbotError):
    """Raised when a planner plugin returned something else than a path."""


class Planner(Protocol):
    """Interface of a global planner; a custom one is named as `pkg.module:Class` in the launch file."""

    def plan(self, costmap: Costmap, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Return poses (n, 3) x, y, yaw from start to goal in the costmap's frame; raise PlanningError if none."""


def checked_path(path: Any, plugin: str) -> NDArray[np.float64]:
    """Return what `plan` returned as an array (n, 3). InvalidPathError, with the plugin's name, if it is none."""
    try:
        poses = np.asarray(path, np.float64)
    except (TypeError, ValueError):
        poses = np.empty(0)
    if poses.ndim != 2 or poses.shape[1] != 3 or not np.isfinite(poses).all():
        shape = getattr(path, "shape", type(path).__name__)
        raise InvalidPathError(
            f"plugin {plugin!r}: plan must return finite poses (n, 3) x, y, yaw, not {shape}"
        )
    return poses
