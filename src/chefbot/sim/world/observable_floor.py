"""The floor of a world that a robot can observe from where it can get."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import Grid
from chefbot.robot.spec import Robot
from chefbot.sim.world.floor_plan import reachable
from chefbot.sim.world.free_floor import MARGIN
from chefbot.sim.world.world import World

RAYS = 360
"""Rays around a viewpoint; what lies between two far away is near another viewpoint."""
SPACING = 0.75
"""Side of the squares with a viewpoint each, m."""


def observable_floor(world: World, robot: Robot, plan: Grid) -> NDArray[np.bool_]:
    """Return the free cells (h, w) of a floor plan that the robot's mapping sensor can see from where it can get.

    plan: at the height of that sensor, in the frame of the robot's start. A room behind a gap that is too narrow for
    the robot is seen through the gap only.
    """
    sensor = robot.sensors.lidar or robot.sensors.depth_camera
    assert sensor is not None  # a robot file without both is refused
    viewpoints = world.start.inverse().apply(_viewpoints(reachable(world, robot, MARGIN)))
    return _visible(plan, viewpoints, sensor.range_max)


def _viewpoints(floor: Grid) -> NDArray[np.float64]:
    """Return the middle (n, 2), m, of one free cell of each square that has any."""
    rows, columns = np.nonzero(floor.cells == 0)
    side = max(round(SPACING / floor.resolution), 1)
    _, first = np.unique(rows // side * floor.width + columns // side, return_index=True)
    cells = np.column_stack([columns[first], rows[first]]) + 0.5
    return cells * floor.resolution + np.array([floor.origin_x, floor.origin_y])


def _visible(plan: Grid, viewpoints: NDArray[np.float64], reach: float) -> NDArray[np.bool_]:
    """Return the free cells (h, w) that a straight line of up to `reach` metres connects with a viewpoint (n, 2)."""
    free, seen = plan.cells == 0, np.zeros(plan.cells.shape, np.bool_)
    angles = np.linspace(0.0, 2.0 * math.pi, RAYS, endpoint=False)[:, None]
    # half a cell from point to point, so that no ray passes a corner of a wall
    distances = np.arange(0.0, reach / plan.resolution, 0.5)
    along_x, along_y = np.cos(angles) * distances, np.sin(angles) * distances
    for x, y in ((viewpoints - [plan.origin_x, plan.origin_y]) / plan.resolution).tolist():
        columns = np.clip((along_x + x).astype(np.int64), 0, plan.width - 1)
        rows = np.clip((along_y + y).astype(np.int64), 0, plan.height - 1)
        open_so_far = np.logical_and.accumulate(free[rows, columns], axis=1)
        seen[rows[open_so_far], columns[open_so_far]] = True
    return seen
