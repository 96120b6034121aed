"""Frontier-based exploration: choose the next viewpoint, and record why other frontiers are skipped."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.exploration.frontiers import Frontier, find_frontiers
from chefbot.exploration.params import ExplorerParams
from chefbot.exploration.required_gain import RequiredGain
from chefbot.exploration.visibility import best_view, nearest_reachable, unknown_in_view
from chefbot.maths.angles import wrap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

FULL_TURN = 2.0 * math.pi
LOOK_AROUND_GAIN_RATIO = 2.0
"""Minimum ratio of unknown area all around to that ahead for which a narrow sensor turns around."""
MIN_BLOCKED_GAIN = 4.0
"""Minimum unknown area behind a blocked passage, m^2, for which the robot checks it again."""
MIN_HIDDEN_GAIN = 1.0
"""Minimum unknown area in view from beside a frontier, m^2, that is worth a goal if the first viewpoint is not."""
FAILED = "failed {} times"
UNREACHABLE = "unreachable: no path to a place that sees it"
TOO_SMALL = "too small: the robot would not fit through"
TOO_LITTLE = "too small: less unknown floor than the robot covers"
DIMINISHED = "too little unknown floor, after goals that showed hardly any"
CLOSE_VIEW = 1.0 / 3.0
"""Distance of a viewpoint beside its frontier, share of the maximum distance."""
LEARNED_WEIGHT = 0.5
"""How much an attempt counts after which the planner knows of an obstacle, such as glass, that it did not know of."""
HELD_UP_WEIGHT = 0.25
"""How much an attempt counts that a person has held up: people go on."""
GAIN_POWER = 0.25
"""Exponent of the gain; below 1 it favours near goals, so that no second tour is needed for small corners."""


class ExplorationGoal(NamedTuple):
    """A viewpoint: drive to `pose`, which sees the frontier at (x, y), and turn around if `look_around`.

    gain: square metres of unknown floor in view. cost: path length, turning and a fixed cost per goal, m.
    blocked: no viewpoint of the frontier is reachable; the robot looks from the nearest reachable place.
    """

    pose: SE2
    x: float
    y: float
    look_around: bool
    gain: float
    cost: float
    blocked: bool = False


class SkippedFrontier(NamedTuple):
    """A frontier that stays unexplored: position, length (m) and reason; `failed`: after repeated attempts."""

    x: float
    y: float
    length: float
    reason: str
    failed: bool = False


class ExplorationDecision(NamedTuple):
    """The next goal, None when exploration is complete, and the skipped frontiers with their reasons.

    enclosed: there are frontiers, but hardly any floor is reachable from where the robot stands.
    """

    goal: ExplorationGoal | None
    skipped: tuple[SkippedFrontier, ...]
    enclosed: bool = False


class Explorer:
    """Select the goal with the largest gain^(1/4) / cost (after Gonzalez-Banos & Latombe 2002).

    field_of_view: radians, of the mapping sensor, 2 pi for a lidar; its forward direction is the robot's.
    robot_radius: metres; a frontier shorter than the robot's width is not passable. When no other goal
    remains, blocked passages are checked again, since the obstacle may be a person in a doorway.
    """

    def __init__(
        self, robot_radius: float, field_of_view: float = FULL_TURN, params: ExplorerParams | None = None
    ) -> None:
        self.params = params or ExplorerParams()
        self.min_frontier_length = 2.0 * robot_radius
        self._robot_area = math.pi * robot_radius**2
        self._required_gain = RequiredGain(self._robot_area)
        self.field_of_view = min(field_of_view, FULL_TURN)
        self._failed_goals: list[tuple[float, float, float]] = []
        """Frontiers of goals that failed: x, y, and how much each counts."""
        self._blocked_viewpoints: list[tuple[SE2, float]] = []
        """Viewpoints of blocked passages that were tried, and how much each attempt counts."""

    def decide(self, grid: Grid, cost_to_come: NDArray[np.float32], pose: SE2) -> ExplorationDecision:
        """Return the next goal and the skipped frontiers.

        cost_to_come: (h, w) of the grid, path length from the robot in m, inf where unreachable.
        """
        goals: list[ExplorationGoal] = []
        skipped: list[SkippedFrontier] = []
        cost = np.ascontiguousarray(cost_to_come, np.float32)
        for frontier in find_frontiers(grid, self.params.free_threshold, self.params.max_frontier_length):
            result = self._evaluate(grid, cost, pose, frontier)
            if isinstance(result, ExplorationGoal):
                goals.append(result)
            else:
                skipped.append(result)
        # Nothing else remains: check blocked passages again
        goals = goals or self._goals_for_blocked(grid, cost, skipped)
        # Utility: gain^GAIN_POWER / cost
        best = max(goals, key=lambda goal: goal.gain**GAIN_POWER / goal.cost, default=None)
        reachable = int(np.count_nonzero(np.isfinite(cost))) * grid.resolution**2
        enclosed = bool(skipped) and reachable <= self._robot_area
        return ExplorationDecision(best, tuple(skipped), enclosed)

    def mark_failed(self, goal: ExplorationGoal, weight: float = 1.0) -> None:
        """Record a failed goal: it could not be reached, or its frontier remains after the visit.

        weight: how much the attempt counts, of `max_attempts`.
        """
        if goal.blocked:
            self._blocked_viewpoints.append((goal.pose, weight))
        else:
            self._failed_goals.append((goal.x, goal.y, weight))

    def give_up(self, goal: ExplorationGoal) -> None:
        """Choose no goal for this frontier again."""
        for _ in range(self.params.max_attempts):
            self.mark_failed(goal)

    def has_failed(self, goal: ExplorationGoal) -> bool:
        """Return whether a drive to this goal, or to another one of its frontier, has failed before."""
        return (
            self._attempts_near(goal.pose) > 0 if goal.blocked else bool(self._failures_near(goal.x, goal.y))
        )

    def note_gain(self, goal: ExplorationGoal, shown: float) -> None:
        """Take by how many square metres the map has grown on the way to a goal."""
        self._required_gain.update(goal.gain, shown)

    def frontier_remains(self, grid: Grid, goal: ExplorationGoal) -> bool:
        """Return whether a frontier wide enough for the robot remains near the goal's frontier."""
        tolerance = self.params.same_goal_distance
        return any(
            frontier.length >= self.min_frontier_length
            and math.hypot(frontier.x - goal.x, frontier.y - goal.y) <= tolerance
            for frontier in find_frontiers(grid, self.params.free_threshold, self.params.max_frontier_length)
        )

    def _evaluate(
        self, grid: Grid, cost: NDArray[np.float32], pose: SE2, frontier: Frontier
    ) -> ExplorationGoal | SkippedFrontier:
        """Return a goal for the frontier, or the frontier with the reason why there is none."""
        skipped = SkippedFrontier(frontier.x, frontier.y, frontier.length, TOO_LITTLE)
        if frontier.length < self.min_frontier_length:
            return skipped._replace(reason=TOO_SMALL)
        # Give up after repeated failures near this frontier
        failed = self._failures_near(frontier.x, frontier.y)
        if sum(failed) >= self.params.max_attempts:
            return skipped._replace(reason=FAILED.format(len(failed)), failed=True)
        gain, required = -math.inf, self._required_gain.value
        for cell in self._viewpoints(grid, cost, frontier, close_first=bool(failed)):
            goal = self._goal(grid, float(cost[cell]), pose, frontier, cell)
            if goal.gain >= required:
                return goal
            gain, required = max(gain, goal.gain), max(required, MIN_HIDDEN_GAIN)
        if gain < 0.0:
            return skipped._replace(reason=UNREACHABLE)
        return skipped._replace(reason=DIMINISHED) if gain >= self._required_gain.minimum else skipped

    def _failures_near(self, x: float, y: float) -> list[float]:
        """Return how much each of the failures counts whose frontiers were here."""
        tolerance = self.params.same_goal_distance
        return [
            weight
            for frontier_x, frontier_y, weight in self._failed_goals
            if math.hypot(frontier_x - x, frontier_y - y) <= tolerance
        ]

    def _viewpoints(
        self, grid: Grid, cost: NDArray[np.float32], frontier: Frontier, close_first: bool
    ) -> Iterator[tuple[int, int]]:
        """Yield the cheapest cell that sees the frontier, and the cheapest one beside it.

        Along an edge, such as that of a door leaf, the first one sees the frontier but hardly anything behind.
        close_first: whether the first one has been tried already.
        """
        p, row_column = self.params, grid.cell(frontier.x, frontier.y)
        distances = p.view_distance, CLOSE_VIEW * p.view_distance
        for distance in distances[::-1] if close_first else distances:
            reach = round(distance / grid.resolution)
            row, column = best_view(grid.cells, cost, p.occupied_threshold, *row_column, reach)
            if row >= 0:
                yield row, column

    def _goal(
        self, grid: Grid, path_length: float, pose: SE2, frontier: Frontier, cell: tuple[int, int]
    ) -> ExplorationGoal:
        x, y = grid.centre(*cell)
        is_at_frontier = math.hypot(frontier.x - x, frontier.y - y) < grid.resolution
        yaw = math.atan2(
            frontier.y - (pose.y if is_at_frontier else y), frontier.x - (pose.x if is_at_frontier else x)
        )
        # Information gain: unknown cells in view, looking ahead and all around
        ahead = self._count_unknown(grid, cell, yaw, self.field_of_view)
        around = self._count_unknown(grid, cell, yaw, FULL_TURN)
        look_around = around > LOOK_AROUND_GAIN_RATIO * ahead and self.field_of_view < FULL_TURN
        # Cost: path, turning and a fixed cost per goal
        heading_change = abs(wrap(yaw - pose.yaw)) if self.field_of_view < FULL_TURN else 0.0
        turn = FULL_TURN if look_around else heading_change
        cost = path_length + self.params.turn_cost * turn + self.params.fixed_goal_cost
        area = grid.resolution**2
        gain = max(around if look_around else ahead, 1) * area
        return ExplorationGoal(SE2(x, y, yaw), frontier.x, frontier.y, look_around, gain, cost)

    def _goals_for_blocked(
        self, grid: Grid, cost: NDArray[np.float32], skipped: list[SkippedFrontier]
    ) -> list[ExplorationGoal]:
        goals = (self._goal_for_blocked(grid, cost, frontier) for frontier in skipped)
        return [goal for goal in goals if goal is not None]

    def _goal_for_blocked(
        self, grid: Grid, cost: NDArray[np.float32], frontier: SkippedFrontier
    ) -> ExplorationGoal | None:
        """Return a goal at the reachable place nearest to a blocked frontier; None if the gain is too small."""
        if frontier.reason != UNREACHABLE:
            return None
        row, column = grid.cell(frontier.x, frontier.y)
        gain = self._count_unknown(grid, (row, column), 0.0, FULL_TURN) * grid.resolution**2
        cell = nearest_reachable(cost, row, column, round(self.params.view_range / grid.resolution))
        if gain < max(MIN_BLOCKED_GAIN, self._required_gain.value) or cell is None:
            return None
        x, y = grid.centre(*cell)
        pose = SE2(x, y, math.atan2(frontier.y - y, frontier.x - x))
        if self._attempts_near(pose) >= self.params.max_attempts:
            return None
        path_cost = float(cost[cell]) + self.params.turn_cost * FULL_TURN + self.params.fixed_goal_cost
        return ExplorationGoal(pose, frontier.x, frontier.y, True, gain, path_cost, blocked=True)

    def _attempts_near(self, pose: SE2) -> float:
        return sum(
            weight
            for viewpoint, weight in self._blocked_viewpoints
            if pose.distance(viewpoint) <= self.params.same_goal_distance
        )

    def _count_unknown(self, grid: Grid, cell: tuple[int, int], yaw: float, field_of_view: float) -> int:
        reach = self.params.view_range / grid.resolution
        return unknown_in_view(grid.cells, self.params.occupied_threshold, *cell, yaw, field_of_view, reach)
