"""Where to go next to see what is unknown, until nothing that can be reached is left, and why the rest is
left."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.exploration.frontiers import Frontier, find_frontiers
from chefbot.exploration.params import ExplorerParams
from chefbot.exploration.visibility import best_view, nearest_reachable, unknown_in_view
from chefbot.maths.angles import wrap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

FULL_TURN = 2.0 * math.pi
WORTH_A_TURN = 2.0
"""A narrow sensor looks all around at a goal where that shows so many times more than the view ahead."""
WORTH_A_LOOK = 4.0
"""Square metres of unknown floor behind a blocked way for which the robot looks whether it is open now."""
UNREACHABLE = "unreachable: no path to a place that sees it"
GAIN_POWER = 0.25
"""Below 1 it prefers what is near: small corners are swept on the way instead of by a second tour."""


class Goal(NamedTuple):
    """Go to `pose`, which sees the frontier at (x, y), and if `look_around`, turn about there.

    gain: square metres of unknown floor in view. cost: metres of free driving, with turning. blocked: no way leads
    to where the frontier can be seen; the robot looks from as near as it can come.
    """

    pose: SE2
    x: float
    y: float
    look_around: bool
    gain: float
    cost: float
    blocked: bool = False


class Left(NamedTuple):
    """A frontier that stays unexplored: where, how long (m) and why."""

    x: float
    y: float
    length: float
    reason: str


class Decision(NamedTuple):
    """The next goal, None when exploration is done, and what is left aside with the reasons."""

    goal: Goal | None
    left: tuple[Left, ...]


class Explorer:
    """Chooses the goal with the most unknown floor in view per metre of way (Gonzalez-Banos & Latombe 2002).

    field_of_view: radians of the mapping sensor, 2 pi for a lidar that sees all around; its forward
    direction is the robot's. robot_radius: metres; a frontier shorter than the robot is wide leads nowhere
    for it. When nothing else is left it looks again at ways that are blocked, as by somebody who stands in a door.
    """

    def __init__(
        self, robot_radius: float, field_of_view: float = FULL_TURN, params: ExplorerParams | None = None
    ) -> None:
        self.params = params or ExplorerParams()
        self.least_length = 2.0 * robot_radius
        self.least_gain = math.pi * robot_radius**2
        self.field_of_view = min(field_of_view, FULL_TURN)
        self._fruitless: list[tuple[float, float]] = []
        self._looked_from: list[SE2] = []

    def decide(self, grid: Grid, cost_to_come: NDArray[np.float32], pose: SE2) -> Decision:
        """Where to go now. cost_to_come: (h, w) of the grid, metres from the robot, inf where it cannot
        go."""
        goals: list[Goal] = []
        left: list[Left] = []
        cost = np.ascontiguousarray(cost_to_come, np.float32)
        for frontier in find_frontiers(grid, self.params.free_below, self.params.longest):
            outcome = self._judge(grid, cost, pose, frontier)
            if isinstance(outcome, Goal):
                goals.append(outcome)
            else:
                left.append(Left(frontier.x, frontier.y, frontier.length, outcome))
        goals = goals or [goal for one in left if (goal := self._look_again(grid, cost, one)) is not None]
        best = max(goals, key=lambda goal: goal.gain**GAIN_POWER / goal.cost, default=None)
        return Decision(best, tuple(left))

    def fruitless(self, goal: Goal) -> None:
        """The goal could not be reached, or was reached and its frontier is still there."""
        if goal.blocked:
            self._looked_from.append(goal.pose)
        else:
            self._fruitless.append((goal.x, goal.y))

    def still_there(self, grid: Grid, goal: Goal) -> bool:
        """Whether a frontier that the robot could pass is still near where the goal's was."""
        near = self.params.same_place
        return any(
            frontier.length >= self.least_length
            and math.hypot(frontier.x - goal.x, frontier.y - goal.y) <= near
            for frontier in find_frontiers(grid, self.params.free_below, self.params.longest)
        )

    def _judge(self, grid: Grid, cost: NDArray[np.float32], pose: SE2, frontier: Frontier) -> Goal | str:
        """A goal for the frontier, or the reason why there is none."""
        if frontier.length < self.least_length:
            return "too small: the robot would not fit through"
        near = self.params.same_place
        failed = sum(math.hypot(x - frontier.x, y - frontier.y) <= near for x, y in self._fruitless)
        if failed >= self.params.attempts:
            return f"failed {failed} times"
        p, row_column = self.params, grid.cell(frontier.x, frontier.y)
        reach = round(p.view_distance / grid.resolution)
        row, column = best_view(grid.cells, cost, p.occupied_from, *row_column, reach)
        if row < 0:
            return UNREACHABLE
        goal = self._goal(grid, float(cost[row, column]), pose, frontier, (row, column))
        return goal if goal.gain >= self.least_gain else "too small: less unknown floor than the robot covers"

    def _goal(self, grid: Grid, way: float, pose: SE2, frontier: Frontier, place: tuple[int, int]) -> Goal:
        x, y = grid.centre(*place)
        here = math.hypot(frontier.x - x, frontier.y - y) < grid.resolution
        yaw = math.atan2(frontier.y - (pose.y if here else y), frontier.x - (pose.x if here else x))
        ahead = self._unknown(grid, place, yaw, self.field_of_view)
        around = self._unknown(grid, place, yaw, FULL_TURN)
        look_around = around > WORTH_A_TURN * ahead and self.field_of_view < FULL_TURN
        turn = abs(wrap(yaw - pose.yaw)) if self.field_of_view < FULL_TURN else 0.0
        cost = way + self.params.turn_cost * (FULL_TURN if look_around else turn) + self.params.fixed_cost
        area = grid.resolution**2
        gain = max(around if look_around else ahead, 1) * area
        return Goal(SE2(x, y, yaw), frontier.x, frontier.y, look_around, gain, cost)

    def _look_again(self, grid: Grid, cost: NDArray[np.float32], left: Left) -> Goal | None:
        """From the reachable place nearest to a frontier whose way is blocked; None where that is not worth it."""
        if left.reason != UNREACHABLE:
            return None
        row, column = grid.cell(left.x, left.y)
        gain = self._unknown(grid, (row, column), 0.0, FULL_TURN) * grid.resolution**2
        place = nearest_reachable(cost, row, column, round(self.params.view_range / grid.resolution))
        if gain < WORTH_A_LOOK or place is None:
            return None
        x, y = grid.centre(*place)
        pose = SE2(x, y, math.atan2(left.y - y, left.x - x))
        looks = sum(pose.distance(one) <= self.params.same_place for one in self._looked_from)
        if looks >= self.params.attempts:
            return None
        way = float(cost[place]) + self.params.turn_cost * FULL_TURN + self.params.fixed_cost
        return Goal(pose, left.x, left.y, True, gain, way, blocked=True)

    def _unknown(self, grid: Grid, place: tuple[int, int], yaw: float, field: float) -> int:
        reach = self.params.view_range / grid.resolution
        return unknown_in_view(grid.cells, self.params.occupied_from, *place, yaw, field, reach)
