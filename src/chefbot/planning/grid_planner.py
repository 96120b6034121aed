"""The built-in global planner: A* on the costmap, followed by path smoothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.lanes import NO_LANES, OneWayLanes
from chefbot.maths.se2 import SE2
from chefbot.planning import graph_search, smoothing
from chefbot.planning.cost_grid import CostGrid, pad
from chefbot.planning.goal_sight import has_sight
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import PlanningError, PlanningFailure

MAX_FREE_COST = INSCRIBED - 1
"""Highest cost of a cell in which the robot's centre may be."""
SMOOTHING_ITERATIONS = 20
OCCUPIED = "the goal is occupied; the robot drives to the nearest free pose with sight of it"
STEADINESS = 0.15
"""Difference of their distances to an occupied goal up to which two poses are equally near to it, m."""
MAX_SEARCHES = 12
"""Searches for a path on which the footprint does not collide; each excludes the places where the last one did."""


class GridPlanner:
    """Plans minimum-cost paths, through unknown cells only if allowed.

    No cell of the path has a cost of INSCRIBED or more. With a polygonal footprint, no pose of the
    path collides, save those at the start: where one does, the search is repeated without the cells around it.
    For an occupied goal it plans to the nearest free pose with sight of it; `walls` is the static map that no
    sight leads through. `notices` are sentences about what the last `plan` had to relax: a start inside the
    inflation, an occupied goal. No step leads against a one-way lane. Reuses its working arrays between calls (9
    bytes per cell).
    """

    def __init__(self, params: PlannerParams | None = None) -> None:
        self.params = params or PlannerParams()
        self.notices: tuple[str, ...] = ()
        self.walls: Callable[[], Costmap] | None = None
        self._occupied: tuple[SE2, SE2] | None = None
        self._weight = cost_to_weight(self.params)
        self._padded = np.zeros((0, 0), np.uint8)
        self._g = np.zeros(0, np.float32)
        self._written = np.zeros(0, np.int32)
        self._written_count = 0
        self._load_lanes(NO_LANES)

    def plan(self, costmap: Costmap, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Return poses (n, 3) from `start` to `goal`, or to the nearest reachable cell within tolerance of it.

        Every pose heads along the path, the last one has the goal's heading. Raises PlanningError.
        """
        path = self._plan(costmap, start, goal)
        if not len(costmap.footprint):
            return path
        blocked = replace(costmap, cells=costmap.cells.copy())
        for _ in range(MAX_SEARCHES):
            collisions = self._collisions(costmap, path)
            if not len(collisions):
                return path
            for pose in collisions:
                _block(blocked, pose)
            path = self._plan(blocked, start, goal)
        raise PlanningError(PlanningFailure.NO_VALID_PATH, goal)

    def _collisions(self, costmap: Costmap, path: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses of the path (n, 3) at which the footprint collides, without those in the escape radius."""
        start = SE2.of(path[0])
        poses = [SE2.of(pose) for pose in path]
        far = [start.distance(pose) > self.params.escape for pose in poses]
        hit = [out and costmap.lethal_on_footprint(pose) > 0 for out, pose in zip(far, poses, strict=True)]
        return path[np.array(hit, np.bool_)]

    def _plan(self, costmap: Costmap, start: SE2, goal: SE2) -> NDArray[np.float64]:
        """Search once, for the centre of the robot."""
        self.notices = ()
        self._require_inside(costmap, start, PlanningFailure.START_OUTSIDE_MAP)
        self._require_inside(costmap, goal, PlanningFailure.GOAL_OUTSIDE_MAP)
        self._load_costmap(costmap)
        source = self._source_cell(costmap, start)
        # search to the goal, or to the nearest open cell within tolerance of it
        goal_cell, candidates = self._flat_index(costmap, goal), self._goal_candidates(costmap, start, goal)
        if not len(candidates):
            raise PlanningError(PlanningFailure.GOAL_OCCUPIED, goal)
        self._search(source, int(candidates[0]))
        # if that one is unreachable, everything has been searched: take the nearest candidate reached
        reached = candidates[np.isfinite(self._g[candidates])]
        if not len(reached):
            raise self._no_path_error(start, goal)
        if reached[0] == goal_cell:
            self._occupied = None
        else:
            self._replace_occupied_goal(costmap, goal, int(reached[0]))
        return self._path(costmap, start, goal, int(reached[0]), exact=reached[0] == goal_cell)

    def _replace_occupied_goal(self, costmap: Costmap, goal: SE2, cell: int) -> None:
        self._occupied = goal, self._goal_at(costmap, goal, cell, exact=False)
        away = self._occupied[1].distance(goal)
        self.notices += (f"{OCCUPIED}, {away:.2f} m from the goal",)

    def potential(self, costmap: Costmap, start: SE2) -> NDArray[np.float32]:
        """Return the cost-to-come of every cell (h, w), in metres of free driving; inf where unreachable."""
        self.notices = ()
        self._require_inside(costmap, start, PlanningFailure.START_OUTSIDE_MAP)
        self._load_costmap(costmap)
        self._search(self._source_cell(costmap, start), -1)
        return self._g.reshape(self._padded.shape)[1:-1, 1:-1] * np.float32(costmap.resolution)

    def _require_inside(self, costmap: Costmap, pose: SE2, failure: PlanningFailure) -> None:
        h, w = costmap.cells.shape
        column, row = self._to_padded_cells(costmap, pose)
        if not (1.0 <= column < w + 1 and 1.0 <= row < h + 1):
            raise PlanningError(failure, pose)

    def _to_padded_cells(self, costmap: Costmap, pose: SE2) -> tuple[float, float]:
        """Return x, y of the pose in cells of the padded grid."""
        return (
            (pose.x - costmap.origin_x) / costmap.resolution + 1.0,
            (pose.y - costmap.origin_y) / costmap.resolution + 1.0,
        )

    def _flat_index(self, costmap: Costmap, pose: SE2) -> int:
        column, row = self._to_padded_cells(costmap, pose)
        return int(row) * self._padded.shape[1] + int(column)

    def _load_costmap(self, costmap: Costmap) -> None:
        """Copy the costmap into the padded grid and reset the working arrays."""
        h, w = costmap.cells.shape
        if self._padded.shape != (h + 2, w + 2):
            self._padded = np.empty((h + 2, w + 2), np.uint8)
            self._g = np.full(self._padded.size, np.inf, np.float32)
            self._written = np.empty(self._padded.size, np.int32)
        else:
            graph_search.clear(self._g, self._written, self._written_count)
        self._written_count = 0
        pad(costmap.cells, LETHAL, self._padded)
        self._load_lanes(costmap.lanes)

    def _load_lanes(self, lanes: OneWayLanes) -> None:
        """Set the lanes (number of each cell of the padded grid, directions), empty without lanes."""
        number = np.pad(lanes.number, 1).reshape(-1) if lanes.number.any() else np.zeros(0, np.uint8)
        self._lanes = number, lanes.directions

    def _source_cell(self, costmap: Costmap, start: SE2) -> int:
        """Return the start's cell; if it is blocked, open inscribed and unknown cells near it at the highest cost."""
        source = self._flat_index(costmap, start)
        cost = self._padded.reshape(-1)[source]
        if self._weight[cost] > 0:
            return source
        location = {INSCRIBED: "too near to an obstacle", LETHAL: "inside an obstacle"}.get(
            int(cost), "in the unknown"
        )
        self.notices += (f"the robot stands {location}; within {self.params.escape:.2f} m it may drive out",)
        nearby = self._cells_within(costmap, start, self.params.escape)
        costs = self._padded.reshape(-1)[nearby]
        self._padded.reshape(-1)[nearby[(costs == INSCRIBED) | (costs == UNKNOWN)]] = MAX_FREE_COST
        self._padded.reshape(-1)[source] = MAX_FREE_COST
        return source

    def _cells_within(self, costmap: Costmap, pose: SE2, radius: float) -> NDArray[np.int64]:
        """Return the map cells whose centres are within `radius` metres of the pose, sorted by distance."""
        x, y = self._to_padded_cells(costmap, pose)
        radius_cells = radius / costmap.resolution
        height, stride = self._padded.shape
        rows = np.arange(max(1, int(y - radius_cells)), min(height - 1, int(y + radius_cells) + 1))
        columns = np.arange(max(1, int(x - radius_cells)), min(stride - 1, int(x + radius_cells) + 1))
        distance = np.hypot(rows[:, None] + 0.5 - y, columns[None, :] + 0.5 - x).reshape(-1)
        index = (rows[:, None] * stride + columns[None, :]).reshape(-1)
        order = np.argsort(distance, kind="stable")
        return index[order[distance[order] <= radius_cells]].astype(np.int64)

    def _goal_candidates(self, costmap: Costmap, start: SE2, goal: SE2) -> NDArray[np.int64]:
        """Return the open cells within tolerance of the goal: its own cell, then the others by distance."""
        cells = np.concatenate(
            ([self._flat_index(costmap, goal)], self._cells_within(costmap, goal, self.params.tolerance))
        )
        free = cells[self._weight[self._padded.reshape(-1)[cells]] > 0]
        if len(free) and free[0] != cells[0]:
            free = self._seeing(costmap, start, goal, free)
        if not len(costmap.footprint):
            return free
        poses = [self._goal_at(costmap, goal, int(cell), exact=i == 0) for i, cell in enumerate(free)]
        return free[np.array([costmap.lethal_on_footprint(pose) == 0 for pose in poses], np.bool_)]

    def _seeing(self, costmap: Costmap, start: SE2, goal: SE2, free: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the cells with sight of an occupied goal, one of the nearest first.

        Of cells that are about equally near to the goal it is the one nearest to the pose of the plan before, or to
        the start: marks at the edge of an obstacle come and go, and the robot must not drive round it each time.
        """
        poses = [self._goal_at(costmap, goal, int(cell), exact=False) for cell in free]
        points = np.array([(pose.x, pose.y) for pose in poses])
        if self.walls is not None:
            seeing = has_sight(self.walls(), points, goal)
            free, points = free[seeing], points[seeing]
        if not len(free):
            return free
        away = np.hypot(points[:, 0] - goal.x, points[:, 1] - goal.y)
        before = self._occupied[1] if self._occupied is not None and self._occupied[0] == goal else start
        detour = np.hypot(points[:, 0] - before.x, points[:, 1] - before.y)
        first = int(np.argmin(np.where(away <= away.min() + STEADINESS, detour, np.inf)))
        return np.concatenate((free[first : first + 1], np.delete(free, first)))

    def _goal_at(self, costmap: Costmap, goal: SE2, cell: int, *, exact: bool) -> SE2:
        """Return the goal, or its heading at the centre of another cell."""
        if exact and cell == self._flat_index(costmap, goal):
            return goal
        stride = self._padded.shape[1]
        return SE2(*costmap.centre(cell // stride - 1, cell % stride - 1), goal.yaw)

    @property
    def _grid(self) -> CostGrid:
        return CostGrid(self._padded.reshape(-1), self._weight, self._padded.shape[1], *self._lanes)

    def _search(self, source: int, goal: int) -> None:
        self._written_count, _ = graph_search.search(self._grid, source, goal, self._g, self._written)

    def _no_path_error(self, start: SE2, goal: SE2) -> PlanningError:
        """Return the error of an exhaustive search that did not reach the goal."""
        costs = self._padded.reshape(-1)[self._written[: self._written_count]]
        if self.notices and not (costs < MAX_FREE_COST).any():
            return PlanningError(PlanningFailure.START_OCCUPIED, start)
        return PlanningError(PlanningFailure.NO_VALID_PATH, goal)

    def _path(self, costmap: Costmap, start: SE2, goal: SE2, end: int, *, exact: bool) -> NDArray[np.float64]:
        grid, stride = self._grid, self._padded.shape[1]
        # backtrack the cells and shorten them along straight lines
        chain = graph_search.descend(grid, end, self._g)
        if self.params.smooth:
            chain = chain[smoothing.pull(grid, self._g, chain)]
        points = np.stack([chain % stride + 0.5, chain // stride + 0.5], axis=1)
        # replace the first and last cell centres by the exact start and goal
        if exact:
            points = self._with_exact_end(points, self._to_padded_cells(costmap, goal))
        points = self._with_exact_end(points, self._to_padded_cells(costmap, start), at_start=True)
        if self.params.smooth:
            # round the corners of the evenly spaced path
            points = smoothing.resample(points, self.params.spacing / costmap.resolution)
            smoothing.relax(grid, points, SMOOTHING_ITERATIONS)
        # from cells of the padded grid to metres
        metres = (points - 1.0) * costmap.resolution + np.array([costmap.origin_x, costmap.origin_y])
        return smoothing.with_headings(metres, goal.yaw)

    def _with_exact_end(
        self, points: NDArray[np.float64], end: tuple[float, float], *, at_start: bool = False
    ) -> NDArray[np.float64]:
        """Return the polyline (n, 2) with `end`, a point of its last (first) cell, instead of it or beside it."""
        from_end = points if at_start else points[::-1]
        if len(points) > 1:
            ends = (end, from_end[1]) if at_start else (from_end[1], end)
            cost = smoothing.line_cost(self._grid, *ends[0], *ends[1])
            from_end = from_end[1:] if cost < math.inf else from_end
        with_end = np.concatenate([[end], from_end])
        return with_end if at_start else with_end[::-1].copy()


def _block(costmap: Costmap, pose: NDArray[np.float64]) -> None:
    """Raise the cost of the cells at a pose at which the footprint collides to INSCRIBED."""
    row, column = costmap.cell(float(pose[0]), float(pose[1]))
    around = costmap.cells[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    around[around < INSCRIBED] = INSCRIBED


def cost_to_weight(params: PlannerParams) -> NDArray[np.float32]:
    """Return the traversal weight by cost, (256,): 1 if free, 1 + cost_weight at 252, 0 if blocked."""
    weight = 1.0 + params.cost_weight * np.arange(256) / MAX_FREE_COST
    weight[INSCRIBED:] = 0.0
    if params.allow_unknown:
        weight[UNKNOWN] = 1.0 + params.unknown_weight
    return weight.astype(np.float32)


def path_length(path: NDArray[np.float64]) -> float:
    """Return the length of a path with poses (n, 2 or 3), m."""
    return float(sum(math.hypot(dx, dy) for dx, dy in np.diff(path[:, :2], axis=0)))
