"""Where a robot waits for a blocked way: before doorways and narrow places, where people can pass it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.blockage import Blockage
from chefbot.planning.parking import PERSON_WIDTH, ParkingSearch
from chefbot.planning.planner import Planner, PlanningError

STANDOFF = 0.8
"""Length of the way that stays free before the first blocked pose, m: room for those who come out."""
LOOK_BACK = 4.0
"""Length of the way up to which the robot drives back to make room, m."""
APART, IN_SIGHT = 1.0, 2.0
"""Distances of such a place from the blocked pose, m: at least, and up to which its sensors see when it is free."""
FAR_WEIGHT = 2.0
"""Metres of driving that one metre nearer to the blocked pose is worth, beyond IN_SIGHT."""
SPACING = 0.2
"""Distance between two places on the way that are tried, m."""
MAX_TRIALS = 200


class WaitingPlace(NamedTuple):
    """The pose to wait at, and whether people can pass the robot there."""

    pose: SE2
    leaves_way_open: bool


def find_waiting_place(
    search: ParkingSearch, planner: Planner, costs: Costmap, robot: SE2, blockage: Blockage
) -> WaitingPlace:
    """Return where to wait: the nearest place to the blockage on the way to it that leaves the way open.

    If there is none, a place beside the way from which it sees the blockage and that it gets to soon, else where it
    is. It looks towards the blockage. search: knows the static map.
    """
    on_way = _on_the_way(search, costs, blockage)
    if on_way is not None:
        return WaitingPlace(on_way, True)
    blocked = SE2.of(blockage.free[blockage.blocked])
    for row, column in _beside(planner, costs, robot, blockage.distance, blocked):
        x, y = costs.centre(row, column)
        if search.leaves_way_open(row, column, (PERSON_WIDTH,)):
            return WaitingPlace(SE2(x, y, math.atan2(blocked.y - y, blocked.x - x)), True)
    return WaitingPlace(robot, False)


def _on_the_way(search: ParkingSearch, costs: Costmap, blockage: Blockage) -> SE2 | None:
    """Return the last place before the blockage that leaves the way open."""
    free = blockage.free
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(free[:, :2], axis=0).T))))
    last = length[blockage.blocked] - STANDOFF
    for s in np.arange(max(last, 0.0) if last >= 0.0 else -1.0, -1e-9, -SPACING).tolist():
        pose = SE2.of(free[int(np.searchsorted(length, s))])
        cell = costs.cell(pose.x, pose.y)
        if costs.at(pose.x, pose.y) < INSCRIBED and search.leaves_way_open(*cell, (PERSON_WIDTH,)):
            return pose
    return None


def _beside(planner: Planner, costs: Costmap, robot: SE2, distance: float, blocked: SE2) -> NDArray[np.int64]:
    """Return cells (n, 2), row and column, to which the robot gets and from which it sees the blocked pose.

    The best are first: near to the robot, and not farther from the blocked pose than IN_SIGHT. distance: length of
    the way to that pose, m.
    """
    try:
        potential = planner.potential(costs, robot)
    except PlanningError:
        return np.zeros((0, 2), np.int64)
    cells = np.argwhere((potential <= LOOK_BACK + distance) & (costs.cells < INSCRIBED))
    x = costs.origin_x + (cells[:, 1] + 0.5) * costs.resolution
    y = costs.origin_y + (cells[:, 0] + 0.5) * costs.resolution
    gap = np.hypot(x - blocked.x, y - blocked.y)
    score = potential[cells[:, 0], cells[:, 1]] + FAR_WEIGHT * np.maximum(gap - IN_SIGHT, 0.0)
    order = np.argsort(score, kind="stable")
    order = order[gap[order] >= APART]
    return cells[order[:: 1 + len(order) // MAX_TRIALS]]
