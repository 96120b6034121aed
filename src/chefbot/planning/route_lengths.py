"""Lengths of routes on the map: safe upper bounds from cost-to-come tables that are kept per place, and paths."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner, path_length
from chefbot.planning.planner import PlanningError

TOLERANCE = 0.6
"""Distance from a pose within which the nearest reachable cell counts, m: tables are within the inflation."""
DETOUR = 1.5
"""Ratio of a path to the straight line where the map shows no path: a door that is closed on it, an unmapped room."""


class RouteLengths:
    """Lengths on a costmap of the map without obstacles that may leave.

    A length is the cost-to-come of the planner in metres: near walls it is more than the path, never less.
    """

    def __init__(self, costmap: Costmap, planner: GridPlanner | None = None) -> None:
        self._costmap, self._planner = costmap, planner or GridPlanner()
        self._tables: dict[SE2, NDArray[np.float32] | None] = {}

    def between(self, a: SE2, b: SE2) -> float:
        """Return an upper bound of the length of the path between two poses, m; the table of `b` is kept."""
        length = self._cost_to_come(a, b)
        return length if math.isfinite(length) else DETOUR * a.distance(b)

    def has_path(self, a: SE2, b: SE2) -> bool:
        """Return whether there is a path between two poses; the table of `a` is kept."""
        return math.isfinite(self._cost_to_come(b, a))

    def path_length(self, a: SE2, b: SE2) -> float:
        """Return the length of the planner's path between two poses, m; inf where there is none."""
        try:
            return path_length(self._planner.plan(self._costmap, a, b))
        except PlanningError:
            return self._cost_to_come(a, b)

    def table(self, pose: SE2) -> NDArray[np.float32] | None:
        """Return the lengths (h, w) from a pose to all cells, inf where there is no path; None outside the map."""
        if pose not in self._tables:
            try:
                self._tables[pose] = self._planner.potential(self._costmap, pose).copy()
            except PlanningError:
                self._tables[pose] = None
        return self._tables[pose]

    def forget(self, pose: SE2) -> None:
        """Drop the table of a pose that is no longer needed."""
        self._tables.pop(pose, None)

    def _cost_to_come(self, a: SE2, b: SE2) -> float:
        table = self.table(b)
        return math.inf if table is None else self._lowest_near(table, a)

    def _lowest_near(self, table: NDArray[np.float32], pose: SE2) -> float:
        row, column = self._costmap.cell(pose.x, pose.y)
        reach = math.ceil(TOLERANCE / self._costmap.resolution)
        window = table[max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1]
        rows, columns = np.indices(window.shape)
        apart = np.hypot(rows - min(row, reach), columns - min(column, reach))
        near = np.where(np.isfinite(window) & (apart <= reach), apart, math.inf)
        if not near.size or not np.isfinite(near).any():
            return math.inf
        best = np.unravel_index(np.argmin(near), near.shape)
        return float(window[best]) + float(near[best]) * self._costmap.resolution
