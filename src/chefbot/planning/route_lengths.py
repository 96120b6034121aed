"""Lengths of routes on the map: safe upper bounds from cost-to-come tables that are kept per place, and paths."""

from __future__ import annotations

import math
from dataclasses import replace

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

    A length is the cost-to-come of the planner in metres: near walls it is more than the path, never less. With
    one-way lanes the way back may be another one, or none.
    """

    def __init__(self, costmap: Costmap, planner: GridPlanner | None = None) -> None:
        self._costmap, self._planner = costmap, planner or GridPlanner()
        self._from: dict[SE2, NDArray[np.float32] | None] = {}
        self._to = self._from  # without lanes a length is the same in both directions
        self._opposite = costmap
        if costmap.lanes.names:
            self._to, self._opposite = {}, replace(costmap, lanes=costmap.lanes.reversed)

    def between(self, a: SE2, b: SE2) -> float:
        """Return an upper bound of the length of the path from one pose to another, m; a table of `b` is kept."""
        length = self._cost_to_go(a, b)
        return length if math.isfinite(length) else DETOUR * a.distance(b)

    def has_path(self, a: SE2, b: SE2) -> bool:
        """Return whether there is a path from one pose to another; the table of `a` is kept."""
        return math.isfinite(self._lowest_near(self.table(a), b))

    def has_path_to(self, b: SE2, a: SE2) -> bool:
        """Return whether there is a path to the first pose from the second; a table of the first is kept."""
        return math.isfinite(self._cost_to_go(a, b))

    def path_length(self, a: SE2, b: SE2) -> float:
        """Return the length of the planner's path from one pose to another, m; inf where there is none."""
        try:
            return path_length(self._planner.plan(self._costmap, a, b))
        except PlanningError:
            return self._cost_to_go(a, b)

    def table(self, pose: SE2) -> NDArray[np.float32] | None:
        """Return the lengths (h, w) from a pose to all cells, inf where there is no path; None outside the map."""
        return self._table(self._from, self._costmap, pose)

    def forget(self, pose: SE2) -> None:
        """Drop the tables of a pose that is no longer needed."""
        self._from.pop(pose, None)
        self._to.pop(pose, None)

    def _table(
        self, tables: dict[SE2, NDArray[np.float32] | None], costmap: Costmap, pose: SE2
    ) -> NDArray[np.float32] | None:
        if pose not in tables:
            try:
                tables[pose] = self._planner.potential(costmap, pose).copy()
            except PlanningError:
                tables[pose] = None
        return tables[pose]

    def _cost_to_go(self, a: SE2, b: SE2) -> float:
        return self._lowest_near(self._table(self._to, self._opposite, b), a)

    def _lowest_near(self, table: NDArray[np.float32] | None, pose: SE2) -> float:
        if table is None:
            return math.inf
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
