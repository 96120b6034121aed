"""Obstacles before which exploration failed although the map shows free floor, as at a mirror or behind glass."""

from __future__ import annotations

import dataclasses
import math

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
INFLATION_MARGIN = 1
"""Cells by which a costmap inflates an obstacle by more than the robot's inscribed radius: padding and rounding."""
BODY_MARGIN = 2
"""Cells around the robot's body in which an obstacle would leave its own cell occupied."""
FREE_AROUND_ROBOT = 0.4
"""Distance from the robot within which inscribed cells are no blockage, m: it has to get away from there."""
INSCRIBED = 99
"""Occupancy of cells of the costmap whose distance from an obstacle is less than the robot's inscribed radius."""


class Blockages:
    """Obstacles of the planner's costmap, but not of the map, at the places where the robot could not go on.

    The sensor that makes the map may see through them: what lies beyond is on the map, and cannot be reached.
    inscribed_radius: that of the robot, m.
    """

    def __init__(self, inscribed_radius: float) -> None:
        self._radius = inscribed_radius
        self._points: Floats = np.zeros((0, 2))

    def add(self, robot: SE2, path: Floats, costmap: Grid, grid: Grid) -> bool:
        """Add what the costmap (OCCUPIED: lethal), but not the map, has in the way of a robot that failed here.

        path: (n, 2 or 3) from the robot to the goal on the map; empty if there is none. Returns whether some of it
        was not known before.
        """
        self.forget_gone(robot, costmap, grid)
        known = len(self._points)
        new = self._obstacles(robot, path, costmap, grid), self._entrance(robot, path, costmap, grid)
        self._points = np.unique(np.vstack([self._points, *new]), axis=0)
        return len(self._points) > known

    def _obstacles(self, robot: SE2, path: Floats, costmap: Grid, grid: Grid) -> Floats:
        """Return the lethal cells (n, 2) near the robot and its path, m."""
        x, y = _cells_from(OCCUPIED, costmap)
        near = np.hypot(x - robot.x, y - robot.y) <= REACH
        near |= _distance_to(path, x, y) <= PATH_REACH
        chosen = near & ~_is_near_obstacle(grid, WALL_MARGIN, x, y)
        return np.column_stack([x[chosen], y[chosen]])

    def _entrance(self, robot: SE2, path: Floats, costmap: Grid, grid: Grid) -> Floats:
        """Return the inscribed cells (n, 2) where the path enters them, m, unless obstacles of the map make them so.

        A gap beside an obstacle that is marked in part only looks wider on the map than to the planner.
        """
        entered = _first_entered(costmap.values(path[:, 0], path[:, 1], outside=0) >= INSCRIBED)
        if entered < 0:
            return np.zeros((0, 2))
        x, y = _cells_from(INSCRIBED, costmap)
        near = np.hypot(x - path[entered, 0], y - path[entered, 1]) <= PATH_REACH
        near &= np.hypot(x - robot.x, y - robot.y) > FREE_AROUND_ROBOT
        margin = math.ceil(self._radius / grid.resolution)
        chosen = near & ~_is_near_obstacle(grid, margin, x, y)
        return np.column_stack([x[chosen], y[chosen]])

    def forget_gone(self, robot: SE2, costmap: Grid, grid: Grid) -> None:
        """Forget what was within REACH of the robot and is gone from the costmap, or on the map, or where it stands.

        A cell beside an obstacle of the map is inscribed because of that one, and is no obstacle of its own.
        """
        if not len(self._points):
            return
        x, y = self._points[:, 0], self._points[:, 1]
        distance, cost = np.hypot(x - robot.x, y - robot.y), costmap.values(x, y, outside=0)
        margin = math.ceil(self._radius / grid.resolution) + INFLATION_MARGIN
        marked = (cost >= OCCUPIED) & ~_is_near_obstacle(grid, WALL_MARGIN, x, y)
        beside = (cost >= INSCRIBED) & ~_is_near_obstacle(grid, margin, x, y)
        apart = distance > self._radius + BODY_MARGIN * costmap.resolution
        self._points = self._points[(distance > REACH) | (apart & (marked | beside))]

    def on(self, grid: Grid) -> Grid:
        """Return the map with what is known as obstacles."""
        if not len(self._points):
            return grid
        cells = grid.cells.copy()
        cells[_indices(grid, self._points[:, 0], self._points[:, 1])] = OCCUPIED
        return dataclasses.replace(grid, cells=cells)


def without_room(costmap: Grid, grid: Grid) -> NDArray[np.bool_]:
    """Return in which cells (h, w) of the map the planner's costmap leaves no room for the robot."""
    closed = np.zeros(grid.cells.shape, np.bool_)
    closed[_indices(grid, *_cells_from(INSCRIBED, costmap))] = True
    return closed


def _indices(grid: Grid, x: Floats, y: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows and columns of points (n,), m, without those that are outside the grid."""
    rows = np.floor((y - grid.origin_y) / grid.resolution).astype(np.int64)
    columns = np.floor((x - grid.origin_x) / grid.resolution).astype(np.int64)
    inside = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width)
    return rows[inside], columns[inside]


def _distance_to(path: Floats, x: Floats, y: Floats) -> Floats:
    """Return the distance of points (n,) from the nearest point of a path, m; inf without one."""
    from scipy.spatial import KDTree

    if not len(path):
        return np.full(len(x), np.inf)
    distances: Floats = KDTree(path[:, :2]).query(np.column_stack([x, y]))[0]
    return distances


def _cells_from(occupancy: int, costmap: Grid) -> tuple[Floats, Floats]:
    """Return x and y of the cells (n,) with at least this occupancy, m."""
    cells = np.argwhere(costmap.cells >= occupancy).astype(np.float64) + 0.5
    return (
        costmap.origin_x + cells[:, 1] * costmap.resolution,
        costmap.origin_y + cells[:, 0] * costmap.resolution,
    )


def _first_entered(inside: NDArray[np.bool_]) -> int:
    """Return the first index that is inside after one that is not, -1 if there is none."""
    entered = np.flatnonzero(inside[1:] & ~inside[:-1])
    return int(entered[0]) + 1 if len(entered) else -1


def _is_near_obstacle(grid: Grid, margin: int, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Return for points (n,) whether an obstacle of the map is within so many cells."""
    from scipy.ndimage import maximum_filter

    occupied: NDArray[np.int8] = (grid.cells >= OCCUPIED_THRESHOLD).astype(np.int8)
    widened = dataclasses.replace(grid, cells=maximum_filter(occupied, 2 * margin + 1))
    near: NDArray[np.bool_] = widened.values(x, y, outside=0) > 0
    return near
