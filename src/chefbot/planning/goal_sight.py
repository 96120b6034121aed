"""Line of sight to a goal: which cells near an occupied goal are on its side of the walls."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.se2 import SE2

SAMPLES_PER_CELL = 2.0
"""Samples along a line of sight for each cell of its length."""


def has_sight(walls: Costmap, points: NDArray[np.float64], goal: SE2) -> NDArray[np.bool_]:
    """Return for each point (n, 2), m, whether the goal can be seen from it over the static map `walls`.

    A line of sight may end in a wall, if the goal itself is in one, but not lead through it: cells that are lethal or
    unknown are followed by such cells only.
    """
    if not len(points):
        return np.zeros(0, np.bool_)
    offsets = points - (goal.x, goal.y)
    longest = float(np.hypot(offsets[:, 0], offsets[:, 1]).max())
    count = math.ceil(SAMPLES_PER_CELL * longest / walls.resolution) + 1
    # from the goal outwards: (n, count, 2)
    samples = (goal.x, goal.y) + np.linspace(0.0, 1.0, count)[:, None] * offsets[:, None, :]
    blocked = _is_blocked(walls, samples)
    # no blocked sample after a free one, seen from the goal
    seen_free = np.logical_or.accumulate(~blocked, axis=1)
    return np.asarray(~(seen_free & blocked).any(axis=1))


def _is_blocked(walls: Costmap, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether each point (..., 2) is in a lethal or unknown cell, or outside the map."""
    h, w = walls.cells.shape
    columns = np.floor((points[..., 0] - walls.origin_x) / walls.resolution).astype(np.int64)
    rows = np.floor((points[..., 1] - walls.origin_y) / walls.resolution).astype(np.int64)
    inside = (rows >= 0) & (rows < h) & (columns >= 0) & (columns < w)
    cells = walls.cells[np.clip(rows, 0, h - 1), np.clip(columns, 0, w - 1)]
    return ~inside | (cells >= LETHAL)
