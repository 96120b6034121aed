"""The built-in global planner: A* over the costmap, then a path pulled straight."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning import graph_search, smoothing
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import Failure, PlanningError

DEAREST = INSCRIBED - 1
SWEEPS = 20


class GridPlanner:
    """Least-cost paths for a disk: no cell at or above INSCRIBED, and unknown ones only if allowed.

    `remarks` tells in sentences what the last `plan` had to relax: a start inside the inflation, a goal
    moved. Keeps its working arrays between calls (13 bytes a cell).
    """

    def __init__(self, params: PlannerParams | None = None) -> None:
        self.params = params or PlannerParams()
        self.remarks: tuple[str, ...] = ()
        self._weight = weights_of(self.params)
        self._padded = np.zeros((0, 0), np.uint8)
        self._weights = np.zeros(0, np.float32)
        self._g = np.zeros(0, np.float32)
        self._written = np.zeros(0, np.int32)
        self._count = 0

    def plan(self, costmap: Costmap, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Poses (n, 3) from `start` to `goal` or to the nearest reachable place within tolerance of it.

        Every pose looks along the path, the last one as the goal says. Raises PlanningError.
        """
        self.remarks = ()
        self._inside(costmap, start, Failure.START_OUTSIDE_MAP)
        self._inside(costmap, goal, Failure.GOAL_OUTSIDE_MAP)
        self._load(costmap)
        source = self._source(costmap, start)
        wanted, candidates = self._index(costmap, goal), self._candidates(costmap, goal)
        if not len(candidates):
            raise PlanningError(Failure.GOAL_OCCUPIED, goal)
        self._search(source, int(candidates[0]))
        reached = candidates[np.isfinite(self._g[candidates])]
        if not len(reached):
            raise self._no_way(start, goal)
        if reached[0] != wanted:
            self.remarks += (
                "the goal cannot be reached; the nearest place within tolerance is taken instead",
            )
        return self._path(costmap, start, goal, int(reached[0]), exact=reached[0] == wanted)

    def potential(self, costmap: Costmap, start: SE2) -> NDArray[np.float32]:
        """Cost-to-come of every cell (h, w), in metres of free driving; inf where no way leads."""
        self.remarks = ()
        self._inside(costmap, start, Failure.START_OUTSIDE_MAP)
        self._load(costmap)
        self._search(self._source(costmap, start), -1)
        return self._g.reshape(self._padded.shape)[1:-1, 1:-1] * np.float32(costmap.resolution)

    def _inside(self, costmap: Costmap, pose: SE2, failure: Failure) -> None:
        h, w = costmap.cells.shape
        column, row = self._cells_of(costmap, pose)
        if not (1.0 <= column < w + 1 and 1.0 <= row < h + 1):
            raise PlanningError(failure, pose)

    def _cells_of(self, costmap: Costmap, pose: SE2) -> tuple[float, float]:
        """x, y of the pose in cells of the padded grid."""
        return (
            (pose.x - costmap.origin_x) / costmap.resolution + 1.0,
            (pose.y - costmap.origin_y) / costmap.resolution + 1.0,
        )

    def _index(self, costmap: Costmap, pose: SE2) -> int:
        column, row = self._cells_of(costmap, pose)
        return int(row) * self._padded.shape[1] + int(column)

    def _load(self, costmap: Costmap) -> None:
        """The costmap into the padded grid; the working arrays clean."""
        h, w = costmap.cells.shape
        if self._padded.shape != (h + 2, w + 2):
            self._padded = np.empty((h + 2, w + 2), np.uint8)
            self._weights = np.empty(self._padded.size, np.float32)
            self._g = np.full(self._padded.size, np.inf, np.float32)
            self._written = np.empty(self._padded.size, np.int32)
        else:
            graph_search.clear(self._g, self._written, self._count)
        self._count = 0
        graph_search.pad(costmap.cells, LETHAL, self._padded)

    def _source(self, costmap: Costmap, start: SE2) -> int:
        """The start's cell; if it is blocked, inscribed or unknown cells near it open at the highest cost."""
        source = self._index(costmap, start)
        cost = self._padded.reshape(-1)[source]
        if self._weight[cost] > 0:
            return source
        kind = {INSCRIBED: "too near to an obstacle", LETHAL: "inside an obstacle"}.get(
            int(cost), "in the unknown"
        )
        self.remarks += (f"the robot stands {kind}; within {self.params.escape:.2f} m it may drive out",)
        near = self._near(costmap, start, self.params.escape)
        codes = self._padded.reshape(-1)[near]
        self._padded.reshape(-1)[near[(codes == INSCRIBED) | (codes == UNKNOWN)]] = DEAREST
        self._padded.reshape(-1)[source] = DEAREST
        return source

    def _near(self, costmap: Costmap, pose: SE2, radius: float) -> NDArray[np.int64]:
        """Cells of the map whose middle is within `radius` metres, the nearest first."""
        x, y = self._cells_of(costmap, pose)
        reach = radius / costmap.resolution
        height, stride = self._padded.shape
        rows = np.arange(max(1, int(y - reach)), min(height - 1, int(y + reach) + 1))
        columns = np.arange(max(1, int(x - reach)), min(stride - 1, int(x + reach) + 1))
        away = np.hypot(rows[:, None] + 0.5 - y, columns[None, :] + 0.5 - x).reshape(-1)
        index = (rows[:, None] * stride + columns[None, :]).reshape(-1)
        order = np.argsort(away, kind="stable")
        return index[order[away[order] <= reach]].astype(np.int64)

    def _candidates(self, costmap: Costmap, goal: SE2) -> NDArray[np.int64]:
        """Open cells within tolerance of the goal, its own first, then the nearest first."""
        cells = np.concatenate(
            ([self._index(costmap, goal)], self._near(costmap, goal, self.params.tolerance))
        )
        return cells[self._weight[self._padded.reshape(-1)[cells]] > 0]

    def _search(self, source: int, goal: int) -> None:
        graph_search.weigh(self._padded.reshape(-1), self._weight, self._weights)
        heaviest, stride = float(self._weight.max()), self._padded.shape[1]
        self._count, _ = graph_search.search(
            self._weights, heaviest, stride, source, goal, self._g, self._written
        )

    def _no_way(self, start: SE2, goal: SE2) -> PlanningError:
        """After a search that has seen all there is to reach."""
        codes = self._padded.reshape(-1)[self._written[: self._count]]
        if self.remarks and not (codes < DEAREST).any():
            return PlanningError(Failure.START_OCCUPIED, start)
        return PlanningError(Failure.NO_VALID_PATH, goal)

    def _path(self, costmap: Costmap, start: SE2, goal: SE2, end: int, *, exact: bool) -> NDArray[np.float64]:
        weight, stride = self._weights, self._padded.shape[1]
        way = graph_search.descend(weight, stride, end, self._g)
        if self.params.smooth:
            way = way[smoothing.pull(weight, stride, self._g, way)]
        points = np.stack([way % stride + 0.5, way // stride + 0.5], axis=1)
        if exact:
            points = self._end_at(points, self._cells_of(costmap, goal))
        points = self._end_at(points[::-1], self._cells_of(costmap, start))[::-1].copy()
        if self.params.smooth:
            points = smoothing.resample(points, self.params.spacing / costmap.resolution)
            smoothing.relax(weight, stride, points, SWEEPS)
        metres = (points - 1.0) * costmap.resolution + np.array([costmap.origin_x, costmap.origin_y])
        return smoothing.with_headings(metres, goal.yaw)

    def _end_at(self, points: NDArray[np.float64], end: tuple[float, float]) -> NDArray[np.float64]:
        """The chain (n, 2) with `end`, a point of its last cell, in place of the last one or behind it."""
        if len(points) > 1:
            stride = self._padded.shape[1]
            if smoothing.line_cost(self._weights, stride, *points[-2], *end) < math.inf:
                points = points[:-1]
        return np.concatenate([points, [end]])


def weights_of(params: PlannerParams) -> NDArray[np.float32]:
    """Weight of a cell by its cost, (256,): 1 in the free, 1 + cost_weight at 252, 0 where it is blocked."""
    weight = 1.0 + params.cost_weight * np.arange(256) / DEAREST
    weight[INSCRIBED:] = 0.0
    if params.allow_unknown:
        weight[UNKNOWN] = 1.0 + params.unknown_weight
    return weight.astype(np.float32)


def path_length(path: NDArray[np.float64]) -> float:
    """Metres along the poses (n, 2 or 3)."""
    return float(sum(math.hypot(dx, dy) for dx, dy in np.diff(path[:, :2], axis=0)))
