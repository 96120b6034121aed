"""Local replanning of a global path around obstacles in the local costmap.

Map, localization and odometry disagree by a cell or two; in a narrow passage the path then crosses what the
sensors measure as the wall, and a controller that looks a second ahead finds no admissible command (timed elastic
bands and Nav2's smoother modify paths for the same reason).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import Planner, PlanningError

CHECK_DISTANCE = 1.5
"""Length of path ahead that is checked for collisions, m: the horizon of a controller."""
GOAL_TOLERANCE = 0.15
"""Goal tolerance where the goal is occupied, m: the disagreement expected between map and sensors."""
REJOIN_DISTANCE = 0.3
"""Length of free path behind the obstacle after which the detour rejoins the path, m."""
MAX_DETOUR = 0.5
"""Maximum extra length of the detour, m; a longer one is left to the global planner, which has the map."""
SAMPLE_SPACING = 0.01
"""Distance between two collision checks, m: a fifth of a cell, so that no corner between poses is missed."""


def local_planner() -> GridPlanner:
    """Create the planner for the local costmap."""
    return GridPlanner(PlannerParams(tolerance=GOAL_TOLERANCE))


def replan_locally(
    path: NDArray[np.float64], pose: SE2, costmap: Costmap, planner: Planner
) -> NDArray[np.float64]:
    """Return `path` (n, 3) itself if it is free, else with a detour around the obstacles on it.

    All in one frame. If the end of the path is occupied, it ends within the planner's tolerance of it. The path is
    returned unchanged also if there is no short detour within the costmap; then it is blocked.
    """
    remaining = remaining_path(path, pose)
    length = _arc_length(remaining)
    collides = _collisions(remaining, length, costmap)
    collisions = np.flatnonzero(collides & (length <= CHECK_DISTANCE))
    if not len(collisions):
        return path
    rejoin = _rejoin_index(collides, length, int(collisions[0]))
    try:
        detour = planner.plan(costmap, pose, SE2.of(remaining[rejoin]))
    except PlanningError:
        return path
    if _arc_length(detour)[-1] > length[rejoin] + MAX_DETOUR:
        return path
    return np.concatenate([detour, remaining[rejoin + 1 :]])


def collides_within(path: NDArray[np.float64], pose: SE2, costmap: Costmap, distance: float) -> bool:
    """Return whether a path (n, 3) collides within a distance along it from the pose, m."""
    remaining = remaining_path(path, pose)
    length = _arc_length(remaining)
    return bool((_collisions(remaining, length, costmap) & (length <= distance)).any())


def remaining_length(path: NDArray[np.float64], pose: SE2) -> float:
    """Return the length (m) of the path (n, 3), n >= 1, from its pose nearest to `pose` to its end."""
    return float(_arc_length(remaining_path(path, pose))[-1])


def remaining_path(path: NDArray[np.float64], pose: SE2) -> NDArray[np.float64]:
    """Return the part of the path (n, 3), n >= 1, from its pose nearest to `pose` on."""
    return path[int(np.argmin(np.hypot(path[:, 0] - pose.x, path[:, 1] - pose.y))) :]


def _arc_length(path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the arc length (n,) from the first pose to each, m."""
    return np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))))


def _collisions(
    path: NDArray[np.float64], length: NDArray[np.float64], costmap: Costmap
) -> NDArray[np.bool_]:
    """Return per pose whether the segment to the next one collides; cells outside the costmap count as free."""
    # sample the path densely and look up the costs
    samples = np.arange(0.0, length[-1] + SAMPLE_SPACING, SAMPLE_SPACING)
    x, y = np.interp(samples, length, path[:, 0]), np.interp(samples, length, path[:, 1])
    column = np.floor((x - costmap.origin_x) / costmap.resolution).astype(int)
    row = np.floor((y - costmap.origin_y) / costmap.resolution).astype(int)
    height, width = costmap.cells.shape
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    cost = np.where(inside, costmap.cells[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)], 0)
    # assign every colliding sample to the pose before it
    hit_indices = np.searchsorted(length, samples[(cost >= INSCRIBED) & (cost != UNKNOWN)], side="right") - 1
    collides = np.zeros(len(path), np.bool_)
    collides[hit_indices] = True
    if len(costmap.footprint):
        near = np.flatnonzero(length <= CHECK_DISTANCE)
        collides[near] |= [costmap.lethal_on_footprint(SE2.of(path[i])) > 0 for i in near]
    return collides


def _rejoin_index(collides: NDArray[np.bool_], length: NDArray[np.float64], first: int) -> int:
    """Return the index of the first pose with REJOIN_DISTANCE of free path before it, else of the last pose."""
    blocked = first
    for i in range(first + 1, len(collides)):
        if collides[i]:
            blocked = i
        elif length[i] - length[blocked] >= REJOIN_DISTANCE:
            return i
    return len(collides) - 1
