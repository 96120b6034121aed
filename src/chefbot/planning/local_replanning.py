"""A path planned on the map, mended where what is seen stands in it.

Map, localization and odometry disagree by a cell or two; in a narrow place the plan then leads through what the
sensors see to be the wall, and a controller that looks a second ahead finds no way on (timed elastic bands and
Nav2's smoother mend paths for the same reason).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import Planner, PlanningError

REACH = 1.5
"""Metres of path ahead that are looked at: as far as a controller looks."""
TOLERANCE = 0.15
"""Metres beside a goal that cannot be taken: as much as map and sight may disagree."""
BEHIND = 0.3
"""Metres of free path behind the obstacle after which the old path goes on."""

DETOUR = 0.5
"""Metres that the mended part may be longer: a real way around is for the planner, who knows the map."""
FINE = 0.01
"""Metres between two looks: a fifth of a cell, for the corners that the way from pose to pose cuts."""


def near_planner() -> GridPlanner:
    """For the few metres around."""
    return GridPlanner(PlannerParams(tolerance=TOLERANCE))


def repaired(path: NDArray[np.float64], pose: SE2, costmap: Costmap, planner: Planner) -> NDArray[np.float64]:
    """`path` (n, 3) itself where it is free, else from the robot around what stands in it and on along it.

    All in one frame. Where its very end cannot be taken, it ends within the planner's tolerance of it. Unchanged also
    when there is no short way around within the costmap: then it is blocked.
    """
    ahead = _ahead(path, pose)
    length = _length(ahead)
    touches = _touches(ahead, length, costmap)
    near = np.flatnonzero(touches & (length <= REACH))
    if not len(near):
        return path
    back = _back_on(touches, length, int(near[0]))
    try:
        around = planner.plan(costmap, pose, SE2.of(ahead[back]))
    except PlanningError:
        return path
    if _length(around)[-1] > length[back] + DETOUR:
        return path
    return np.concatenate([around, ahead[back + 1 :]])


def length_left(path: NDArray[np.float64], pose: SE2) -> float:
    """Metres along the path (n, 3), n >= 1, from its pose nearest to `pose` to its end."""
    return float(_length(_ahead(path, pose))[-1])


def _ahead(path: NDArray[np.float64], pose: SE2) -> NDArray[np.float64]:
    """From the nearest pose on."""
    return path[int(np.argmin(np.hypot(path[:, 0] - pose.x, path[:, 1] - pose.y))) :]


def _length(path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Metres from the first pose to each."""
    return np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))))


def _touches(path: NDArray[np.float64], length: NDArray[np.float64], costmap: Costmap) -> NDArray[np.bool_]:
    """Whether the disk cannot get from one pose to the next, for each; outside the costmap nothing is in the way."""
    fine = np.arange(0.0, length[-1] + FINE, FINE)
    x, y = np.interp(fine, length, path[:, 0]), np.interp(fine, length, path[:, 1])
    column = np.floor((x - costmap.origin_x) / costmap.resolution).astype(int)
    row = np.floor((y - costmap.origin_y) / costmap.resolution).astype(int)
    height, width = costmap.cells.shape
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    cost = np.where(inside, costmap.cells[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)], 0)
    hits = np.searchsorted(length, fine[(cost >= INSCRIBED) & (cost != UNKNOWN)], side="right") - 1
    touches = np.zeros(len(path), np.bool_)
    touches[hits] = True
    return touches


def _back_on(touches: NDArray[np.bool_], length: NDArray[np.float64], first: int) -> int:
    """The first pose with BEHIND metres of free path before it, else the end."""
    blocked = first
    for i in range(first + 1, len(touches)):
        if touches[i]:
            blocked = i
        elif length[i] - length[blocked] >= BEHIND:
            return i
    return len(touches) - 1
