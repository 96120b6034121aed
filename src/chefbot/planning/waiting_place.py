"""Where a robot waits for a blocked path: before doorways and narrow places, where people can pass it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, LETHAL, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.blockage import Blockage, PathCosts
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams
from chefbot.planning.parking import PERSON_WIDTH, ParkingSearch
from chefbot.planning.planner import PlanningError

STANDOFF = 0.8
"""Length of the path that stays free before the first blocked pose, m: room for those who come out."""
LOOK_BACK_LENGTH = 4.0
"""Length of the path up to which the robot drives back to make room, m."""
MIN_PLACE_DISTANCE, SIGHT_DISTANCE = 1.0, 2.0
"""Distances of such a place from the blocked pose, m: at least, and up to which its sensors see when it is free."""
SEEN_LENGTH_BEHIND = 0.8
"""Length of the path behind the blocked pose that it is to see as well, m: who has left the doorway may be there."""
FAR_WEIGHT = 2.0
"""Metres of driving that one metre nearer to the blocked pose is worth, beyond SIGHT_DISTANCE."""
SPACING = 0.2
"""Distance between two places on the path that are tried, m."""
MAX_TRIALS = 200


class WaitingPlace(NamedTuple):
    """The pose to wait at, and whether people can pass the robot there."""

    pose: SE2
    leaves_room_to_pass: bool


def find_waiting_place(
    search: ParkingSearch, settings: PlannerParams, path_costs: PathCosts, robot: SE2, blockage: Blockage
) -> WaitingPlace:
    """Return where to wait: the nearest place to the blockage on the path to it that leaves room to pass.

    If there is none, a place beside the path from which it sees the blockage and that it gets to soon, else where it
    is. It looks towards the blockage. search: knows the static map. settings: of the planner.
    """
    costs = path_costs.marked
    view = _View(path_costs.static, blockage)
    on_path = _on_the_path(search, costs, blockage, view)
    if on_path is not None:
        return WaitingPlace(on_path, True)
    cells = _beside(settings, costs, robot, blockage.distance, view.blocked)
    for in_view in (True, False):
        for row, column in cells.tolist():
            x, y = costs.centre(row, column)
            if view.has(x, y) == in_view and search.leaves_room_to_pass(row, column, (PERSON_WIDTH,)):
                heading = math.atan2(view.blocked.y - y, view.blocked.x - x)
                return WaitingPlace(SE2(x, y, heading), True)
    return WaitingPlace(robot, False)


class _View:
    """What can be seen of the blocked pose, and of the path behind it, past the obstacles of the map."""

    def __init__(self, static: Costmap, blockage: Blockage) -> None:
        self.blocked = SE2.of(blockage.free[blockage.blocked])
        self._static, self._step = static, static.resolution / 2.0
        behind = blockage.free[blockage.blocked :]
        length = np.cumsum(np.hypot(*np.diff(behind[:, :2], axis=0, prepend=behind[:1, :2]).T))
        self._end = SE2.of(behind[min(int(np.searchsorted(length, SEEN_LENGTH_BEHIND)), len(behind) - 1)])

    def has(self, x: float, y: float) -> bool:
        """Return whether both are seen from a point."""
        return all(self._sees(x, y, pose) for pose in (self.blocked, self._end))

    def _sees(self, x: float, y: float, pose: SE2) -> bool:
        count = max(2, math.ceil(math.hypot(pose.x - x, pose.y - y) / self._step))
        along = self._static.values(np.linspace(x, pose.x, count), np.linspace(y, pose.y, count), outside=0)
        return not bool((along == LETHAL).any())


def _on_the_path(search: ParkingSearch, costs: Costmap, blockage: Blockage, view: _View) -> SE2 | None:
    """Return the last place before the blockage that leaves room to pass and from which the blockage is seen."""
    free = blockage.free
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(free[:, :2], axis=0).T))))
    last = length[blockage.blocked] - STANDOFF
    for s in np.arange(max(last, 0.0) if last >= 0.0 else -1.0, -1e-9, -SPACING).tolist():
        pose = SE2.of(free[int(np.searchsorted(length, s))])
        cell = costs.cell(pose.x, pose.y)
        fits = costs.at(pose.x, pose.y) < INSCRIBED and view.has(pose.x, pose.y)
        if fits and search.leaves_room_to_pass(*cell, (PERSON_WIDTH,)):
            return pose
    return None


def _beside(
    settings: PlannerParams, costs: Costmap, robot: SE2, distance: float, blocked: SE2
) -> NDArray[np.int64]:
    """Return cells (n, 2), row and column, to which the robot gets and from which it sees the blocked pose.

    The best are first: near to the robot, and not farther from the blocked pose than SIGHT_DISTANCE. distance: length
    of the path to that pose, m.
    """
    try:
        potential = GridPlanner(settings).potential(costs, robot)
    except PlanningError:
        return np.zeros((0, 2), np.int64)
    cells = np.argwhere((potential <= LOOK_BACK_LENGTH + distance) & (costs.cells < INSCRIBED))
    x = costs.origin_x + (cells[:, 1] + 0.5) * costs.resolution
    y = costs.origin_y + (cells[:, 0] + 0.5) * costs.resolution
    gap = np.hypot(x - blocked.x, y - blocked.y)
    score = potential[cells[:, 0], cells[:, 1]] + FAR_WEIGHT * np.maximum(gap - SIGHT_DISTANCE, 0.0)
    order = np.argsort(score, kind="stable")
    order = order[gap[order] >= MIN_PLACE_DISTANCE]
    return cells[order[:: 1 + len(order) // MAX_TRIALS]]
