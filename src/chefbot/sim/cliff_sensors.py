"""Simulated cliff sensors: whether there is floor below each of them."""

from __future__ import annotations

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot
from chefbot.sim.cameras.depth_holes import hole_array
from chefbot.sim.world.world import World


class SimulatedCliffSensors:
    """The cliff sensors of a robot in a world; the only lower floor is that of the world's holes."""

    def __init__(self, robot: Robot, world: World) -> None:
        sensors = robot.sensors.cliff_sensors.values()
        self._points = np.array([(sensor.mount.x, sensor.mount.y) for sensor in sensors])
        margin = np.array([sensor.range_max - sensor.mount.z for sensor in sensors])
        holes = hole_array(world.holes)
        self._x0, self._y0, self._x1, self._y1, depth = holes.T[:, None, :]
        # holes that a sensor sees the bottom of are floor to it
        self._too_deep = depth > margin[:, None]

    @staticmethod
    def of(robot: Robot, world: World) -> SimulatedCliffSensors | None:
        """Return the cliff sensors of a robot, None if it has none."""
        return SimulatedCliffSensors(robot, world) if robot.sensors.cliffs is not None else None

    def measure(self, pose: SE2) -> int:
        """Return which sensors see no floor with the robot at `pose`: bit i for sensor i."""
        x, y = pose.apply(self._points).T[:, :, None]
        inside = (self._x0 < x) & (x < self._x1) & (self._y0 < y) & (y < self._y1)
        sees_none = (inside & self._too_deep).any(axis=1)
        return int(sum(1 << i for i in np.flatnonzero(sees_none).tolist()))
