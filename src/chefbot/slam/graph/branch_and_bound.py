"""Search for a pose in a large window by branch and bound (Hess et al., ICRA 2016, section V, algorithm 3)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.slam.graph.field_pyramid import LEVELS
from chefbot.slam.graph.surface_grid import CELL, FIELD_MAX

Array = NDArray[np.float64]


class SearchWindow(NamedTuple):
    """Poses within `linear` m in both axes and `angular` rad of `centre` (3,), in steps of `turn` rad."""

    centre: Array
    linear: float
    angular: float
    turn: float


def search(
    points: NDArray[np.float32],
    window: SearchWindow,
    levels: NDArray[np.uint8],
    origin: Array,
    min_score: float,
) -> tuple[Array, float] | None:
    """Return the pose (3,) of highest mean field value in the window and that value, 0 to 1.

    Translations are multiples of CELL from the centre. points: (n, 2), m. levels: `field_pyramid` of the field whose
    first cell has its corner at `origin`. Return None if no pose reaches `min_score`.
    """
    turns = math.ceil(window.angular / window.turn)
    radius = math.ceil(window.linear / CELL)
    limit = int(min_score * FIELD_MAX * len(points))
    best, turn, x, y = _search(points, window.centre, turns, window.turn, radius, levels, origin, limit)
    if best <= limit:
        return None
    pose = window.centre + np.array([x * CELL, y * CELL, turn * window.turn])
    return pose, best / (FIELD_MAX * len(points))


@njit(cache=True, nogil=True)
def _search(points, centre, turns, turn, radius, levels, origin, limit):  # type: ignore[no-untyped-def]
    """Return the highest sum above `limit`, the index of its turn, and its offset in cells."""
    n, margin = len(points), 1 << LEVELS
    count = 2 * turns + 1
    # Cells of the points at each heading
    cells = np.empty((count, n, 2), np.int32)
    for k in range(count):
        c, s = math.cos(centre[2] + (k - turns) * turn), math.sin(centre[2] + (k - turns) * turn)
        for i in range(n):
            x, y = (
                c * points[i, 0] - s * points[i, 1] + centre[0],
                s * points[i, 0] + c * points[i, 1] + centre[1],
            )
            cells[k, i, 0] = math.floor((x - origin[0]) / CELL) + margin
            cells[k, i, 1] = math.floor((y - origin[1]) / CELL) + margin
    # Blocks of the coarsest level that covers the window
    top = 0
    while top < LEVELS and (1 << top) < radius:
        top += 1
    side = (2 * radius >> top) + 1
    blocks = np.empty((count * side * side, 3), np.int32)
    bounds = np.empty(count * side * side, np.int64)
    m = 0
    for k in range(count):
        for b in range(side):
            for a in range(side):
                blocks[m, 0], blocks[m, 1], blocks[m, 2] = k, (a << top) - radius, (b << top) - radius
                bounds[m] = _bound(cells[k], blocks[m, 1], blocks[m, 2], levels[top])
                m += 1
    best, best_turn, best_x, best_y = limit, 0, 0, 0
    stack = np.empty((4 * LEVELS + 8, 5), np.int64)
    # Best blocks first: the rest is cut off early
    for m in np.argsort(-bounds, kind="mergesort"):
        if bounds[m] <= best:
            break
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3], stack[0, 4] = (
            bounds[m], top, blocks[m, 0], blocks[m, 1], blocks[m, 2],
        )  # fmt: skip
        size = 1
        while size > 0:
            size -= 1
            bound, level, k, x, y = stack[size]
            if bound <= best:
                continue
            if level == 0:
                best, best_turn, best_x, best_y = bound, k - turns, x, y
                continue
            size = _branch(stack, size, level - 1, k, x, y, radius, cells[k], levels[level - 1], best)
    return best, best_turn, best_x, best_y


@njit(cache=True, nogil=True)
def _branch(stack, size, level, k, x, y, radius, cells, grid, best):  # type: ignore[no-untyped-def]
    """Push the four parts of a block in the order of their bounds, the best last; return the size of the stack."""
    begin = size
    for b in range(2):
        for a in range(2):
            part_x, part_y = x + (a << level), y + (b << level)
            if part_x > radius or part_y > radius:
                continue
            bound = _bound(cells, part_x, part_y, grid)
            if bound <= best:
                continue
            # Insertion sort
            at = size
            while at > begin and stack[at - 1, 0] > bound:
                stack[at] = stack[at - 1]
                at -= 1
            stack[at, 0], stack[at, 1], stack[at, 2], stack[at, 3], stack[at, 4] = (
                bound,
                level,
                k,
                part_x,
                part_y,
            )
            size += 1
    return size


@njit(cache=True, nogil=True)
def _bound(cells, x, y, grid):  # type: ignore[no-untyped-def]
    """Return the sum of the grid's values at the cells (n, 2), shifted by (x, y)."""
    height, width = grid.shape
    total = 0
    for i in range(len(cells)):
        column, row = cells[i, 0] + x, cells[i, 1] + y
        if column >= 0 and row >= 0 and column < width and row < height:
            total += grid[row, column]
    return total
