"""The solids around the robot: of a large map, the physics and the camera get only what they can reach."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chefbot.robot.spec import Robot
from chefbot.sim.world.shapes import GLASS, ShapeArrays, SimulatedShape, shape_arrays
from chefbot.sim.world.world import World

MAX_UNFILTERED_SOLIDS = 2000
"""Number of solids up to which all of them are simulated; with 20 000, a physics step takes five times as long."""
SLACK = 4.0
"""Distance in metres that the robot moves before the solids around it are chosen again."""
BODY_REACH = 3.0
"""Minimum distance in metres to which solids are simulated, for collisions."""
VIEW = 20.0
"""Distance in metres to which the camera's colour image shows solids; its depth ends before."""
OVERLAP = 1e-4
"""Distance in metres by which neighbouring walls of a map overlap: a beam through the corner at which two cells
touch would otherwise depend on rounding errors."""


class NearbySolids:
    """The static solids of a world within reach of the robot, chosen again as it moves.

    What is farther away than the longest range of a sensor changes no reading.
    """

    def __init__(self, world: World, robot: Robot) -> None:
        self._all = world.static if world.floor is None else tuple(map(_grown, world.static))
        self._reach = _longest_range(robot) + SLACK
        self._follows = len(self._all) > MAX_UNFILTERED_SOLIDS
        self._boxes = _bounding_boxes(self._all) if self._follows else np.zeros((0, 4))
        self._centre = math.inf, math.inf
        self.touchable = self._all
        """Solids within reach of the robot's body."""
        self.reflecting = shape_arrays(self._all)
        """Solids within reach of laser and sound."""
        self.visible: ShapeArrays
        """Solids in the camera's view, without glass."""
        self._set_visible(self._all)

    def follow(self, x: float, y: float) -> bool:
        """Choose the solids around the robot at (x, y), m, if it has moved away; return whether they changed."""
        if not self._follows or math.hypot(x - self._centre[0], y - self._centre[1]) <= SLACK:
            return False
        self._centre = x, y
        gaps = self._gaps(x, y)
        self.touchable = tuple(self._all[i] for i in np.flatnonzero(gaps <= BODY_REACH + SLACK).tolist())
        self.reflecting = shape_arrays([self._all[i] for i in np.flatnonzero(gaps <= self._reach).tolist()])
        view = max(VIEW, self._reach)
        self._set_visible([self._all[i] for i in np.flatnonzero(gaps <= view).tolist()])
        return True

    def _gaps(self, x: float, y: float) -> NDArray[np.float64]:
        """Return (n,) distances in metres from a point to the bounding rectangles of all solids."""
        centre_x, centre_y, half_x, half_y = self._boxes.T
        across = np.maximum(np.abs(centre_x - x) - half_x, 0.0)
        along = np.maximum(np.abs(centre_y - y) - half_y, 0.0)
        return np.hypot(across, along)

    def _set_visible(self, solids: Sequence[SimulatedShape]) -> None:
        self.visible = shape_arrays([solid for solid in solids if solid.material != GLASS])


def _grown(shape: SimulatedShape) -> SimulatedShape:
    x, y, z = shape.half
    return shape._replace(half=(x + OVERLAP / 2, y + OVERLAP / 2, z))


def _longest_range(robot: Robot) -> float:
    """Return the longest range of laser and sound, with a metre for their place on the robot."""
    sensors = robot.sensors
    ranges = [sensor.range_max for sensor in (sensors.lidar, sensors.ultrasonic) if sensor is not None]
    return max(ranges, default=0.0) + 1.0


def _bounding_boxes(solids: Sequence[SimulatedShape]) -> NDArray[np.float64]:
    """Return (n, 4): centre x, y and half sides of the bounding rectangle of each solid, m."""
    return np.array([(solid.x, solid.y, *solid.extent) for solid in solids], dtype=np.float64)
