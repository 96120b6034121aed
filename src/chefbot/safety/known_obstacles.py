"""Known obstacles, which explain why a sensor has no data: they are too near for it to measure."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.se2 import SE2

Directions = NDArray[np.float64]


class KnownObstacles(Protocol):
    """Obstacles that a sensor may be too near to measure."""

    def explain(self, directions: Directions, sensor: SE2, reach: float) -> NDArray[np.bool_]:
        """Return in which directions (n,) an obstacle is known within `reach`, m.

        sensor: pose in base_link of the sensor whose directions these are.
        """


class RememberedPoints(NamedTuple):
    """Remembered points as known obstacles.

    points: returns them (m, 2) in base_link, one in each cell of `resolution`, m.
    """

    points: Callable[[], NDArray[np.float64]]
    resolution: float

    def explain(self, directions: Directions, sensor: SE2, reach: float) -> NDArray[np.bool_]:
        """Return in which directions (n,) a point is known within `reach`, see `KnownObstacles`.

        A point stands for a surface up to a cell to each side: the points of neighbouring cells lie up to two apart.
        """
        points = self.points() - (sensor.x, sensor.y)
        distances = np.hypot(points[:, 0], points[:, 1])
        near = distances <= reach
        width = np.arctan2(self.resolution, distances[near])
        bearings = np.arctan2(points[near, 1], points[near, 0])
        apart = (sensor.yaw + directions)[:, None] - bearings
        apart = np.abs(np.remainder(apart + math.pi, 2.0 * math.pi) - math.pi)
        return np.asarray((apart <= width).any(axis=1))


class MarkedCells(NamedTuple):
    """Lethal cells of a costmap as known obstacles.

    pose: of base_link in the costmap's frame; None if it is unknown, so that no cell explains anything.
    """

    costs: Costmap
    pose: SE2 | None

    def explain(self, directions: Directions, sensor: SE2, reach: float) -> NDArray[np.bool_]:
        """Return in which directions (n,) a cell is lethal within `reach`, see `KnownObstacles`."""
        if self.pose is None:
            return np.zeros(len(directions), np.bool_)
        at = self.pose @ sensor
        distances = np.arange(0.0, reach, self.costs.resolution / 2)
        x = at.x + np.cos(at.yaw + directions)[:, None] * distances
        y = at.y + np.sin(at.yaw + directions)[:, None] * distances
        return np.asarray((self.costs.values(x, y, outside=0) == LETHAL).any(axis=1))
