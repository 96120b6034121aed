"""What a local controller takes and gives."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2


class Status(Enum):
    """How the controller fares."""

    RUNNING = "following the path"
    REACHED = "the goal is reached"
    BLOCKED = "every way on would touch something"
    NO_PATH = "there is no path to follow"


class Command(NamedTuple):
    """Twist (m/s, rad/s) and how things stand."""

    v: float
    w: float
    status: Status


class Controller(Protocol):
    """A local controller; name one of your own as `pkg.module:Class` in the launch file."""

    def set_path(self, path: NDArray[np.float64], *, same_goal: bool = False) -> None:
        """Follow these poses (n, 3), in the frame of the poses and costmaps given to `command`.

        same_goal: planned anew, not ordered anew; the frame may have shifted a little under the goal.
        """

    def command(self, pose: SE2, twist: tuple[float, float], costmap: Costmap) -> Command:
        """The twist for the next period, from the pose and the twist (v, w) measured now."""
