"""Minimum-cost search on a costmap: A* and Dijkstra on the eight-connected grid.

A step costs its length in cells times the mean weight of its two cells; a weight is at least 1, or 0 if the cell
is blocked. A diagonal step is allowed only if both adjacent cells are open (no corner cutting). The open list is
a circular bucket queue (Dial 1969): for Dijkstra with buckets one unit wide, the minimum cost of a step, so that
cells expanded from a bucket are final; for A* (Hart, Nilsson & Raphael 1968) wider, so that most cells that are
improved while open stay in their bucket, and a cell that is improved after its expansion is expanded again.
Buckets are first in, first out: last in, first out would follow a long line of cells at a cost that the next
entry makes obsolete. The octile distance is consistent because no weight is below 1; the search ends when the
goal's bucket is empty, so the cost found is the minimum.

A step against a one-way lane is not a step of the graph, like one that cuts a corner: its cost is
infinite in that direction. That leaves the octile distance a lower bound, and the coordinate along a lane never
decreases on a path.

It is one kernel with unsigned indices, because passing arrays for every cell, or checking each index for a
negative value, would cost more than the search itself.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.planning.cost_grid import CostGrid

SQRT2 = math.sqrt(2.0)
HALF = np.float32(0.5)
HALF_DIAGONAL = np.float32(0.5 * SQRT2)
OCTILE = np.float32(SQRT2 - 1.0)
BUCKETS_PER_UNIT = np.float32(0.5)
"""Buckets of A* per unit of cost; half or twice as many take 5 % longer, sixteen a quarter longer."""
ROUND_UP_FACTOR = np.float32(1.0 + 1e-6)
"""Factor that makes a 32-bit sum no less than the exact one."""
ROW_STEPS, COLUMN_STEPS = (0, 0, 1, -1, 1, 1, -1, -1), (1, -1, 0, 0, 1, -1, 1, -1)
"""Row and column offsets of the eight neighbours, the diagonal ones last."""
SPARSE_RATIO = 8
"""A cell in so many is written at random in about the time in which all are written in order."""
MIN_AGAINST_CELLS = 1e-6
"""Cells against a lane's direction from which a step is against it: rounding of a direction across the lane."""


@njit(cache=True, nogil=True)
def clear(g: NDArray[np.float32], written: NDArray[np.int32], count: int) -> None:
    """Reset the cost-to-come of the first `count` cells of `written` to infinity."""
    if count > g.shape[0] // SPARSE_RATIO:
        g[:] = np.inf
        return
    for i in range(count):
        g[written[i]] = np.inf


@njit(cache=True, nogil=True, inline="always")
def _octile(row: int, column: int, goal_row: int, goal_column: int) -> np.float32:
    """Return the octile distance to the goal, a lower bound of the cost-to-go."""
    dr, dc = abs(row - goal_row), abs(column - goal_column)
    return np.float32(max(dr, dc)) + OCTILE * np.float32(min(dr, dc))


@njit(cache=True, nogil=True, inline="always")
def _improves(
    n: int,
    cost: np.float32,
    half: np.float32,
    here: np.float32,
    grid: CostGrid,
    g: NDArray[np.float32],
) -> int:
    """Return 1 if a step of length 2 * half from a cell of weight `here` lowers the cost of cell n, else 0."""
    weight = grid.weight[grid.cells[n]]
    return int((cost + half * (here + weight) < g[n]) & (weight > 0.0))


@njit(cache=True, nogil=True)
def _ring_size(max_weight: np.float32, scale: np.float32) -> int:
    """Return the buckets of a ring: the largest cost of a step plus heuristic, rounded up to a power of two."""
    return 1 << math.ceil(math.log2((2 * SQRT2 * max_weight + 4.0) * scale + 2.0))


@njit(cache=True, nogil=True)
def _open_list(
    cells: int, buckets: int, source: int, slot: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], int]:
    """Create a ring of `buckets` buckets, linked lists whose heads are the first entries; `source` is in `slot`.

    Returns the cell and the successor (-1 for none) of each entry, the last entry of each bucket, and the number of
    entries. A cell is inserted at most twice per neighbour, and memory never touched costs nothing.
    """
    link, tail = np.empty(buckets + 16 * cells, np.int32), np.arange(buckets).astype(np.int32)
    cell = np.empty(len(link), np.int32)
    link[: buckets + 1] = -1
    cell[buckets], link[slot], tail[slot] = source, buckets, buckets
    return cell, link, tail, buckets + 1


@njit(cache=True, nogil=True, inline="always")
def _pop(
    slot: int, cell: NDArray[np.int32], link: NDArray[np.int32], tail: NDArray[np.int32], free: int
) -> tuple[np.uint64, int]:
    """Return the oldest cell of a bucket, and its entry, which becomes the first free one."""
    entry = link[slot]
    link[slot], link[entry] = link[entry], free
    tail[slot] = slot if link[slot] < 0 else tail[slot]
    return np.uint64(cell[entry]), entry


@njit(cache=True, nogil=True, inline="always")
def _append(
    n: int,
    slot: int,
    cell: NDArray[np.int32],
    link: NDArray[np.int32],
    tail: NDArray[np.int32],
    free: int,
    entries: int,
) -> tuple[int, int]:
    """Append cell n to a bucket, in entry `free` or a new one (-1); return the next free one, and their number."""
    entry, entries = (entries, entries + 1) if free < 0 else (free, entries)
    next_free = link[entry] if free >= 0 else -1
    cell[entry], link[entry], link[tail[slot]], tail[slot] = n, -1, entry, entry
    return next_free, entries


@njit(cache=True, nogil=True)
def _neighbour_offsets(stride: int) -> tuple[NDArray[np.uint64], NDArray[np.uint64], NDArray[np.uint64]]:
    """Return the index offsets of the neighbours, and of the two cells adjacent to each diagonal step."""
    down, right = np.array(ROW_STEPS) * stride, np.array(COLUMN_STEPS)
    return (down + right).astype(np.uint64), down.astype(np.uint64), right.astype(np.uint64)


@njit(cache=True, nogil=True, inline="always")
def _cuts_corner(grid: CostGrid, first: np.uint64, second: np.uint64) -> bool:
    """Return whether a cell adjacent to a diagonal step is blocked."""
    return min(grid.weight[grid.cells[first]], grid.weight[grid.cells[second]]) == 0.0


@njit(cache=True, nogil=True, inline="always")
def _against_lane(grid: CostGrid, a: int, b: int, column_step: float, row_step: float) -> bool:
    """Return whether a step from cell a to b leads against the lane of one of them."""
    first, second, direction = grid.lane[a], grid.lane[b], grid.direction
    return (
        min(
            direction[first, 0] * column_step + direction[first, 1] * row_step,
            direction[second, 0] * column_step + direction[second, 1] * row_step,
        )
        < -MIN_AGAINST_CELLS
    )


@njit(cache=True, nogil=True, inline="always")
def _improved_neighbours(
    at: np.uint64,
    cost: np.float32,
    here: np.float32,
    row_on: np.uint64,
    grid: CostGrid,
    g: NDArray[np.float32],
    better: NDArray[np.uint64],
) -> int:
    """Write the indices of the neighbours that cell `at` improves into `better`, and return their number.

    Indices are those of ROW_STEPS and COLUMN_STEPS. Branch-free, because branches would be unpredictable: mostly one
    neighbour is improved.
    """
    step, hits = np.uint64(1), 0
    better[hits] = 0
    hits += _improves(at + step, cost, HALF, here, grid, g)
    better[hits] = 1
    hits += _improves(at - step, cost, HALF, here, grid, g)
    better[hits] = 2
    hits += _improves(at + row_on, cost, HALF, here, grid, g)
    better[hits] = 3
    hits += _improves(at - row_on, cost, HALF, here, grid, g)
    better[hits] = 4
    hits += _improves(at + row_on + step, cost, HALF_DIAGONAL, here, grid, g)
    better[hits] = 5
    hits += _improves(at + row_on - step, cost, HALF_DIAGONAL, here, grid, g)
    better[hits] = 6
    hits += _improves(at - row_on + step, cost, HALF_DIAGONAL, here, grid, g)
    better[hits] = 7
    hits += _improves(at - row_on - step, cost, HALF_DIAGONAL, here, grid, g)
    return hits


@njit(cache=True, nogil=True)
def search(
    grid: CostGrid, source: int, goal: int, g: NDArray[np.float32], written: NDArray[np.int32]
) -> tuple[int, int]:
    """Compute the cost-to-come `g` from `source`: A* until `goal` is final or, if `goal` < 0, Dijkstra everywhere.

    g: flat, filled with inf. written: gets the cells whose g was written. Returns their number and the expansions.
    """
    stride, rows_per_cell = grid.stride, 1.0 / grid.stride
    # bucket width and weight of the heuristic: A* with a goal, Dijkstra without
    scale, h_gain = (BUCKETS_PER_UNIT, np.float32(1.0)) if goal >= 0 else (np.float32(1.0), np.float32(0.0))
    buckets = _ring_size(grid.weight.max(), scale)
    offset, above, beside = _neighbour_offsets(stride)
    down, right, better = np.array(ROW_STEPS), np.array(COLUMN_STEPS), np.empty(8, np.uint64)
    goal_row, goal_column = np.int32(goal // stride), np.int32(goal % stride)
    # initialize the open list with the source, in the bucket of its estimate f = h
    bucket = int(h_gain * _octile(source // stride, source % stride, goal_row, goal_column) * scale)
    cell, link, tail, n_entries = _open_list(g.shape[0], buckets, source, bucket & (buckets - 1))
    g[source], written[0], n_written, n_expanded, free, n_open = 0.0, source, 1, 0, -1, 1
    while n_open > 0 and (goal < 0 or g[goal] * scale >= bucket):
        slot = bucket & (buckets - 1)
        while link[slot] >= 0:
            at, free = _pop(slot, cell, link, tail, free)
            n_open, n_expanded = n_open - 1, n_expanded + 1
            row = np.int32((np.float64(at) + 0.5) * rows_per_cell)  # a division takes longer
            column = np.int32(at) - row * np.int32(stride)
            # skip an outdated entry: the cell was expanded since, from an earlier bucket
            cost, here = g[at], grid.weight[grid.cells[at]]
            estimate = cost + h_gain * _octile(row, column, goal_row, goal_column)
            if int(estimate * ROUND_UP_FACTOR * scale) < bucket:
                continue
            # relax the neighbours whose cost-to-come improves
            for i in range(_improved_neighbours(at, cost, here, np.uint64(stride), grid, g, better)):
                k = better[np.uint64(i)]
                n = at + offset[k]
                if grid.lane.shape[0] > 0 and _against_lane(grid, at, n, right[k], down[k]):
                    continue
                if k > 3 and _cuts_corner(grid, at + above[k], at + beside[k]):
                    continue
                # g(n) = g(at) + length * mean weight; f(n) = g(n) + h(n), never before the present bucket
                there = grid.weight[grid.cells[n]]
                g_old, g_new = g[n], cost + (HALF if k < 4 else HALF_DIAGONAL) * (here + there)
                g[n] = g_new
                h_new = h_gain * _octile(row + down[k], column + right[k], goal_row, goal_column)
                b_new = max(int((g_new + h_new) * scale), bucket)
                if g_old == np.inf:
                    written[n_written] = n
                    n_written += 1
                elif b_new > bucket and b_new == int((g_old + h_new) * scale):
                    continue  # already open in that bucket
                free, n_entries = _append(n, b_new & (buckets - 1), cell, link, tail, free, n_entries)
                n_open += 1
        bucket += 1
    return n_written, n_expanded


@njit(cache=True, nogil=True)
def descend(grid: CostGrid, goal: int, g: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the cells of the path from the source (g = 0) to `goal`, by steepest descent of g from the goal."""
    cells, weight, stride = grid.cells, grid.weight, grid.stride
    steps = np.array([1, -1, stride, -stride, 1 + stride, -1 + stride, 1 - stride, -1 - stride])
    chain = [goal]
    at = goal
    while g[at] > 0.0:
        # the predecessor is the neighbour with the minimum g plus step cost
        best, min_cost = at, np.inf
        for k in range(8):
            n = at + steps[k]
            vertical, sideways = stride if k < 6 else -stride, 1 if k % 2 == 0 else -1
            if k > 3 and min(weight[cells[at + vertical]], weight[cells[at + sideways]]) == 0.0:
                continue
            if grid.lane.shape[0] > 0 and _against_lane(grid, n, at, -COLUMN_STEPS[k], -ROW_STEPS[k]):
                continue
            cost = g[n] + (HALF if k < 4 else HALF_DIAGONAL) * (weight[cells[at]] + weight[cells[n]])
            if g[n] < g[at] and cost < min_cost:
                best, min_cost = n, cost
        at = best
        chain.append(at)
    return np.array(chain[::-1])
