"""Interface of a local controller."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from chefbot.control.people_cost import NearbyPeople
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2


class ControllerStatus(Enum):
    """State of the controller after a command was computed."""

    RUNNING = "following the path"
    REACHED = "the goal is reached"
    BLOCKED = "every trajectory would touch something"
    NO_PATH = "there is no path to follow"


class ControllerCommand(NamedTuple):
    """Commanded twist (m/s, rad/s) and the state of the controller."""

    v: float
    w: float
    status: ControllerStatus


class ComparedTwists(NamedTuple):
    """The velocities that a controller compared in a cycle, in the frame of its pose.

    present: the velocity (v, w) from which each trajectory ramps. twists (n, 2): (v, w), m/s and rad/s. scores (n,):
    lower is better, infinite for what is not admissible. duration: of the trajectories, s.
    """

    pose: SE2
    present: tuple[float, float]
    twists: NDArray[np.float64]
    scores: NDArray[np.float64]
    duration: float


@runtime_checkable
class ComparesTwists(Protocol):
    """Interface of a controller that can show what it chose from."""

    candidates: ComparedTwists | None
    """What the last command was chosen from, None if it followed from the path alone."""


class Controller(Protocol):
    """Interface of a local controller; a custom one is named as `pkg.module:Class` in the launch file."""

    def set_path(self, path: NDArray[np.float64], *, same_goal: bool = False) -> None:
        """Set the path to follow, poses (n, 3) in the frame of the poses and costmaps given to `command`.

        same_goal: a replanned path to the same goal, not a new goal; the frame may have shifted a little since.
        """

    def command(
        self, pose: SE2, twist: tuple[float, float], costmap: Costmap, people: NearbyPeople
    ) -> ControllerCommand:
        """Compute the twist for the next period from the current pose and the measured twist (v, w)."""
