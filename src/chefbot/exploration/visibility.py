"""Visibility on a partially known map."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

RAY_STEP = 0.7
"""Distance between two samples of a ray, cells; a wall of one cell is not skipped."""


@njit(cache=True, nogil=True)
def sees(cells: NDArray[np.int8], occupied: int, r0: int, c0: int, r1: int, c1: int) -> bool:
    """Return whether no occupied and no unknown cell lies between two cells, not counting the second one."""
    steps = max(1, math.ceil(math.hypot(r1 - r0, c1 - c0) / RAY_STEP))
    for i in range(steps):
        r = math.floor(r0 + 0.5 + (r1 - r0) * i / steps)
        # Sample the line from centre to centre
        c = math.floor(c0 + 0.5 + (c1 - c0) * i / steps)
        if (r != r1 or c != c1) and (cells[r, c] >= occupied or cells[r, c] < 0):
            return False
    return True


@njit(cache=True, nogil=True)
def unknown_in_view(
    cells: NDArray[np.int8], occupied: int, row: int, column: int, yaw: float, field: float, reach: float
) -> int:
    """Count the unknown cells hit by rays over `field` radians about `yaw` within `reach` cells, each once."""
    h, w = cells.shape
    side = 2 * math.ceil(reach) + 3
    seen = np.zeros((side, side), np.bool_)
    rays = max(1, math.ceil(field * reach))
    count = 0
    for k in range(rays):
        angle = yaw - field / 2 + field * (k + 0.5) / rays
        # Cast the ray until it leaves the map or hits an occupied cell
        dc, dr = math.cos(angle) * RAY_STEP, math.sin(angle) * RAY_STEP
        for i in range(int(reach / RAY_STEP)):
            r, c = math.floor(row + 0.5 + dr * i), math.floor(column + 0.5 + dc * i)
            if r < 0 or c < 0 or r >= h or c >= w or cells[r, c] >= occupied:
                break
            sr, sc = r - row + side // 2, c - column + side // 2
            if cells[r, c] < 0 and not seen[sr, sc]:
                seen[sr, sc] = True
                count += 1
    return count


@njit(cache=True, nogil=True)
def best_view(
    cells: NDArray[np.int8], cost: NDArray[np.float32], occupied: int, row: int, column: int, reach: int
) -> tuple[int, int]:
    """Return the cell of minimum cost-to-come that sees (row, column), within `reach` cells.

    (-1, -1) if there is none.
    """
    h, w = cells.shape
    best_r, best_c, min_cost = -1, -1, np.inf
    for r in range(max(0, row - reach), min(h, row + reach + 1)):
        for c in range(max(0, column - reach), min(w, column + reach + 1)):
            # of equal costs the first wins; the line of sight is checked last because it is expensive
            in_range = (r - row) ** 2 + (c - column) ** 2 <= reach * reach
            if in_range and cost[r, c] < min_cost and sees(cells, occupied, r, c, row, column):
                best_r, best_c, min_cost = r, c, cost[r, c]
    return best_r, best_c


def nearest_reachable(cost: NDArray[np.float32], row: int, column: int, reach: int) -> tuple[int, int] | None:
    """Return the cell of finite cost-to-come nearest to (row, column), within `reach` cells, or None."""
    top, left = max(0, row - reach), max(0, column - reach)
    rows, columns = np.nonzero(np.isfinite(cost[top : row + reach + 1, left : column + reach + 1]))
    squared_distances = (rows + top - row) ** 2 + (columns + left - column) ** 2
    if not len(squared_distances) or int(squared_distances.min()) > reach**2:
        return None
    nearest = int(squared_distances.argmin())
    return int(rows[nearest]) + top, int(columns[nearest]) + left
