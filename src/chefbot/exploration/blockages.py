"""Obstacles before which exploration failed although the map shows free floor, as at a mirror or behind glass."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import OCCUPIED, OCCUPIED_THRESHOLD, Grid
from chefbot.maths.se2 import SE2

Floats = NDArray[np.float64]

REACH = 2.0
"""Distance from the robot up to which obstacles of the costmap explain why it does not come on, m."""
PATH_REACH = 0.5
"""The same, from its path to the goal on the map: it may have failed far away from what is in the way, m."""
WALL_MARGIN = 1
"""Cells around an obstacle of the map in which a mark of the costmap is that obstacle."""


class Blockages:
    """Obstacles of the planner's costmap, but not of the map, at the places where the robot could not go on.

    The sensor that makes the map may see through them: what lies beyond is on the map, and cannot be reached.
    """

    def __init__(self) -> None:
        self._points: Floats = np.zeros((0, 2))

    def add(self, robot: SE2, path: Floats, costmap: Grid, grid: Grid) -> bool:
        """Add what the costmap (OCCUPIED: lethal), but not the map, has in the way of a robot that failed here.

        path: (n, 2 or 3) from the robot to the goal on the map; empty if there is none. Returns whether some of it
        was not known before.
        """
        self.forget_gone(robot, costmap)
        cells = np.argwhere(costmap.cells == OCCUPIED).astype(np.float64) + 0.5
        x = costmap.origin_x + cells[:, 1] * costmap.resolution
        y = costmap.origin_y + cells[:, 0] * costmap.resolution
        near = np.hypot(x - robot.x, y - robot.y) <= REACH
        near |= _distance_to(path, x, y) <= PATH_REACH
        chosen = near & (_near_obstacles(grid).values(x, y, outside=0) == 0)
        known = len(self._points)
        self._points = np.unique(np.vstack([self._points, np.column_stack([x[chosen], y[chosen]])]), axis=0)
        return len(self._points) > known

    def forget_gone(self, robot: SE2, costmap: Grid) -> None:
        """Forget what was within REACH of the robot and is not on the costmap any more."""
        x, y = self._points[:, 0], self._points[:, 1]
        far = np.hypot(x - robot.x, y - robot.y) > REACH
        self._points = self._points[far | (costmap.values(x, y, outside=0) == OCCUPIED)]

    def on(self, grid: Grid) -> Grid:
        """Return the map with what is known as obstacles."""
        if not len(self._points):
            return grid
        rows = np.floor((self._points[:, 1] - grid.origin_y) / grid.resolution).astype(np.int64)
        columns = np.floor((self._points[:, 0] - grid.origin_x) / grid.resolution).astype(np.int64)
        inside = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width)
        cells = grid.cells.copy()
        cells[rows[inside], columns[inside]] = OCCUPIED
        return dataclasses.replace(grid, cells=cells)


def _distance_to(path: Floats, x: Floats, y: Floats) -> Floats:
    """Return the distance of points (n,) from the nearest point of a path, m; inf without one."""
    from scipy.spatial import KDTree

    if not len(path):
        return np.full(len(x), np.inf)
    distances: Floats = KDTree(path[:, :2]).query(np.column_stack([x, y]))[0]
    return distances


def _near_obstacles(grid: Grid) -> Grid:
    """Return a grid that is 1 within WALL_MARGIN cells of an obstacle of the map, else 0."""
    from scipy.ndimage import maximum_filter

    occupied: NDArray[np.int8] = (grid.cells >= OCCUPIED_THRESHOLD).astype(np.int8)
    return dataclasses.replace(grid, cells=maximum_filter(occupied, 2 * WALL_MARGIN + 1))
