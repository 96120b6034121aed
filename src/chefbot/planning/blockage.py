"""What blocks the path to a goal: people, or something not on the map; and how long the path is without it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import path_length
from chefbot.planning.planner import Planner, PlanningError

BODY_MARKS_RADIUS = 0.4
"""Radius around the middle of a person within which marks are the person's, m: half her width and a stride's lag."""
BESIDE_DISTANCE = 0.25
"""Distance from a body to the robot's edge up to which a person is in its way, m."""
NOTABLE_EXTRA_LENGTH = 0.3
"""Extra length of a path from which another one is blocked, m: less is the noise of two searches."""

Path = NDArray[np.float64]


class Blockage(NamedTuple):
    """What blocks the path to a goal.

    length: of the path around it, m, infinite if there is none. free: the path (n, 3) that would be free without it,
    and `free_length`, m. people: indices of the people on that path, none if it is something else. blocked: index of
    the first pose of that path that is blocked.
    """

    length: float
    free: Path
    free_length: float
    people: tuple[int, ...]
    blocked: int

    @property
    def distance(self) -> float:
        """Length of the path up to the blocked pose, m."""
        return path_length(self.free[: self.blocked + 1])


class PathCosts(NamedTuple):
    """The costs of all marks, and those of the static map alone; one grid."""

    marked: Costmap
    static: Costmap

    def without(self, people: Path, reach: float) -> Costmap:
        """Return the costs without the marks within `reach` metres of people (n, 2)."""
        cells = self.marked.cells.copy()
        h, w = cells.shape
        x = self.marked.origin_x + (np.arange(w) + 0.5) * self.marked.resolution
        y = self.marked.origin_y + (np.arange(h) + 0.5) * self.marked.resolution
        for px, py in people.tolist():
            near = (x[None, :] - px) ** 2 + (y[:, None] - py) ** 2 <= reach * reach
            cells[near] = np.minimum(cells[near], self.static.cells[near])
        return replace(self.marked, cells=cells)


def find_blockage(
    planner: Planner, costs: PathCosts, robot: SE2, goal: SE2, people: Path, radius: float
) -> Blockage | None:
    """Return what blocks the path from the robot to the goal, or None: it is free, or the map itself has no path.

    people: their positions (n, 2). radius: of the robot. All in the frame of the costs, m.
    """
    around = _plan(planner, costs.marked, robot, goal)
    length = math.inf if around is None else path_length(around)
    if len(people):
        free = _plan(planner, costs.without(people, BODY_MARKS_RADIUS + radius), robot, goal)
        found = None if free is None else _blockage(costs.marked, free, length, people, radius)
        if found is not None:
            return found
    if around is not None:
        return None
    free = _plan(planner, costs.static, robot, goal)
    return None if free is None else _blockage(costs.marked, free, length, people, radius)


def _blockage(costs: Costmap, free: Path, length: float, people: Path, radius: float) -> Blockage | None:
    """Return the blockage of a path that is free without some marks; None if it is hardly shorter than the other."""
    free_length = path_length(free)
    if length - free_length < NOTABLE_EXTRA_LENGTH:
        return None
    values = costs.values(free[:, 0], free[:, 1], outside=0)
    hits = np.flatnonzero((values >= INSCRIBED) & (values != UNKNOWN))
    blocked = int(hits[0]) if len(hits) else len(free) - 1
    gaps = np.hypot(free[:, None, 0] - people[None, :, 0], free[:, None, 1] - people[None, :, 1])
    near = (
        np.flatnonzero(gaps.min(axis=0) <= BODY_MARKS_RADIUS + radius + BESIDE_DISTANCE)
        if len(people)
        else ()
    )
    return Blockage(length, free, free_length, tuple(int(i) for i in near), blocked)


def _plan(planner: Planner, costs: Costmap, start: SE2, goal: SE2) -> Path | None:
    try:
        return planner.plan(costs, start, goal)
    except PlanningError:
        return None
