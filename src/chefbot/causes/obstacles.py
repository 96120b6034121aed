"""Which cells of a costmap are in the way: on a path, on a trajectory, or next to a point."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2

LOOK_AHEAD_LENGTH = 1.5
"""Length of path on which obstacles are looked for, m: the horizon of a controller."""
REACH = 0.8
"""Distance from a blocked pose within which its obstacle is looked for, m: more than the radius of a robot."""


class CellCentre(NamedTuple):
    """The centre of a cell in the costmap's frame, m."""

    x: float
    y: float


def nearest_lethal(costs: Costmap, x: float, y: float, reach: float = REACH) -> CellCentre | None:
    """Return the lethal cell nearest to a point, not farther than `reach` metres, or None."""
    n = reach / costs.resolution
    row, column = (y - costs.origin_y) / costs.resolution - 0.5, (x - costs.origin_x) / costs.resolution - 0.5
    top, left = max(math.floor(row - n), 0), max(math.floor(column - n), 0)
    window = costs.cells[top : max(math.ceil(row + n) + 1, 0), left : max(math.ceil(column + n) + 1, 0)]
    rows, columns = np.nonzero(window == LETHAL)
    if not len(rows):
        return None
    squared = (rows + top - row) ** 2 + (columns + left - column) ** 2
    best = int(np.argmin(squared))
    if squared[best] > n * n:
        return None
    return CellCentre(
        float(costs.origin_x + (columns[best] + left + 0.5) * costs.resolution),
        float(costs.origin_y + (rows[best] + top + 0.5) * costs.resolution),
    )


def blocked_index(costs: Costmap, path: NDArray[np.float64]) -> int | None:
    """Return the index of the first pose (n, 3) of a path at which the robot would touch something, or None.

    Unknown cells and those outside the costmap count as free.
    """
    values = costs.values(path[:, 0], path[:, 1], outside=0)
    touches = (values >= INSCRIBED) & (values != UNKNOWN)
    if len(costs.footprint):
        touches |= np.array([costs.lethal_on_footprint(SE2.of(pose)) > 0 for pose in path], np.bool_)
    hits = np.flatnonzero(touches)
    return int(hits[0]) if len(hits) else None


def opposed_lane(costs: Costmap, path: NDArray[np.float64]) -> str:
    """Return the title of the first one-way lane against which a path (n, 3) leads, empty if there is none."""
    if not costs.lanes.names or len(path) < 2:
        return ""
    rows = np.floor((path[:-1, 1] - costs.origin_y) / costs.resolution).astype(np.int64)
    columns = np.floor((path[:-1, 0] - costs.origin_x) / costs.resolution).astype(np.int64)
    opposed = costs.lanes.against(rows, columns, np.diff(path[:, :2], axis=0))
    opposed = opposed[opposed > 0]
    return costs.lanes.names[opposed[0] - 1] if len(opposed) else ""


def remaining(path: NDArray[np.float64], pose: SE2, length: float = LOOK_AHEAD_LENGTH) -> NDArray[np.float64]:
    """Return the part of a path (n, 3) that begins at its pose nearest to the robot, at most `length` metres long."""
    start = int(np.argmin(np.hypot(path[:, 0] - pose.x, path[:, 1] - pose.y)))
    ahead = path[start:]
    steps = np.hypot(*np.diff(ahead[:, :2], axis=0).T)
    return ahead[: int(np.searchsorted(np.cumsum(steps), length)) + 1]


def in_the_way(costs: Costmap, path: NDArray[np.float64], pose: SE2) -> CellCentre | None:
    """Return the obstacle on the path (n, 3) ahead, else the one nearest to the robot, else None."""
    ahead = remaining(path, pose)
    first = blocked_index(costs, ahead)
    found = None if first is None else nearest_lethal(costs, float(ahead[first, 0]), float(ahead[first, 1]))
    return found or nearest_lethal(costs, pose.x, pose.y)


def deviation(path: NDArray[np.float64], other: NDArray[np.float64], pose: SE2) -> float:
    """Return how far a path (n, 3) leads from the other (m, 3) within the look-ahead distance, m."""
    ahead, theirs = remaining(path, pose), remaining(other, pose, 2.0 * LOOK_AHEAD_LENGTH)
    gaps = np.hypot(ahead[:, None, 0] - theirs[None, :, 0], ahead[:, None, 1] - theirs[None, :, 1])
    return float(gaps.min(axis=1).max())
