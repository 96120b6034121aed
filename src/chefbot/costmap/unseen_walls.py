"""Walls of the map that no sensor confirms where they should be seen, such as glass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.maths.se2 import SE2

CONFIRMATION_DISTANCE = 0.15
"""Distance of a measured point from the middle of a cell that it confirms, m: a cell, and the error of the pose."""


def unseen_walls(grid: Grid, robot: SE2, reach: float, measured: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the middles (m, 2) of the occupied cells near a robot that no measured point confirms, in its frame.

    robot: its pose in the map. reach: radius of the search, m. measured: points (n, 2) in the robot's frame. What is
    measured is more exact than the map, so that the map counts only where there is nothing.
    """
    low, high = grid.cell(robot.x - reach, robot.y - reach), grid.cell(robot.x + reach, robot.y + reach)
    first = np.maximum(low, 0)
    near = grid.cells[first[0] : max(high[0] + 1, 0), first[1] : max(high[1] + 1, 0)]
    rows, columns = np.nonzero(near >= OCCUPIED_THRESHOLD)
    middles = (np.column_stack([columns, rows]) + first[::-1] + 0.5) * grid.resolution
    walls = robot.inverse().apply(middles + np.array([grid.origin_x, grid.origin_y]))
    walls = walls[np.hypot(walls[:, 0], walls[:, 1]) <= reach]
    if not len(walls) or not len(measured):
        return walls
    return walls[cdist(walls, measured).min(axis=1) > CONFIRMATION_DISTANCE]
