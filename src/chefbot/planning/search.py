"""Shortest ways over a costmap: A* and Dijkstra on the eight-connected grid.

A step costs its length in cells times the mean weight of its two cells; a weight is at least 1, and 0 says
blocked. A diagonal step is open only if both cells beside it are (no corner is cut). The open list is a
ring of buckets (Dial 1969): for Dijkstra one unit wide, the least that a step costs, so that what is taken
from a bucket is final; for A* (Hart, Nilsson & Raphael 1968) narrower, and a cell that is improved within
its bucket is taken again. The octile distance is consistent because no weight is below 1; the search ends
when the goal's bucket is empty, so the cost found is the least.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

SQRT2 = math.sqrt(2.0)
HALF = np.float32(0.5)
HALF_DIAGONAL = np.float32(0.5 * SQRT2)
LEVELS = 16
"""Buckets per unit of cost for A*, in which steps towards the goal hardly raise the estimate."""
USED, SPENT, WRITTEN, WAITING = range(4)


@njit(cache=True, nogil=True)
def pad(cells: NDArray[np.uint8], rim: int, out: NDArray[np.uint8]) -> None:
    """`cells` (h, w) into the middle of `out` (h + 2, w + 2), with a rim of that cost."""
    h, w = cells.shape
    out[0, :] = rim
    out[h + 1, :] = rim
    for r in range(h):
        out[r + 1, 0] = rim
        out[r + 1, w + 1] = rim
        for c in range(w):
            out[r + 1, c + 1] = cells[r, c]


@njit(cache=True, nogil=True)
def weigh(cells: NDArray[np.uint8], weight: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """The weight of every cell; all flat, `weight` (256,) by cost."""
    for i in range(cells.shape[0]):
        out[i] = weight[cells[i]]


@njit(cache=True, nogil=True)
def _level(cost: np.float32, at: int, goal: int, stride: int) -> int:
    """Bucket of a cell: its cost and, with a goal, the octile distance, the least that any way on can
    cost."""
    if goal < 0:
        return int(cost)
    row, goal_row = np.int32(at) // np.int32(stride), np.int32(goal) // np.int32(stride)
    dr, dc = abs(row - goal_row), abs((at - row * stride) - (goal - goal_row * stride))
    return int((cost + max(dr, dc) + (SQRT2 - 1.0) * min(dr, dc)) * LEVELS)


@njit(cache=True, nogil=True)
def _push(
    n: int,
    cost: np.float32,
    level: int,
    head: NDArray[np.int32],
    cell: NDArray[np.int32],
    key: NDArray[np.float32],
    after: NDArray[np.int32],
    state: NDArray[np.int64],
) -> None:
    """Put a cell into a bucket: a list through `after`, with entries taken from the spent ones first."""
    entry = state[SPENT]
    if entry >= 0:
        state[SPENT] = after[entry]
    else:
        entry = state[USED]
        state[USED] += 1
    slot = level & (head.shape[0] - 1)
    cell[entry], key[entry], after[entry] = n, cost, head[slot]
    head[slot] = entry
    state[WAITING] += 1


@njit(cache=True, nogil=True)
def _expand(
    at: int,
    bucket: int,
    weight: NDArray[np.float32],
    stride: int,
    goal: int,
    g: NDArray[np.float32],
    written: NDArray[np.int32],
    head: NDArray[np.int32],
    cell: NDArray[np.int32],
    key: NDArray[np.float32],
    after: NDArray[np.int32],
    state: NDArray[np.int64],
) -> None:
    """Offer the eight neighbours the way through `at`. One branch each, mostly not taken: the cost is in
    branches."""
    right, left, up, down = weight[at + 1], weight[at - 1], weight[at + stride], weight[at - stride]
    here, cost = weight[at], g[at]
    for k in range(8):
        if k < 4:
            n = at + (1, -1, stride, -stride)[k]
            w = open_to = (right, left, up, down)[k]
            candidate = cost + HALF * (here + w)
        else:
            n = at + (stride + 1, stride - 1, 1 - stride, -1 - stride)[k - 4]
            w = weight[n]
            open_to = min(w, min((up, up, down, down)[k - 4], (right, left, right, left)[k - 4]))
            candidate = cost + HALF_DIAGONAL * (here + w)
        if (candidate < g[n]) & (open_to > 0.0):
            if g[n] == np.inf:
                written[state[WRITTEN]] = n
                state[WRITTEN] += 1
            g[n] = candidate
            level = max(_level(candidate, n, goal, stride), bucket)
            _push(n, candidate, level, head, cell, key, after, state)


@njit(cache=True, nogil=True)
def search(
    weight: NDArray[np.float32],
    heaviest: float,
    stride: int,
    source: int,
    goal: int,
    g: NDArray[np.float32],
    written: NDArray[np.int32],
) -> int:
    """Cost-to-come `g` from `source`, until `goal` is certain or, if `goal` < 0, everywhere.

    weight: flat grid with a blocked rim, rows of `stride` cells, none above `heaviest`. g: flat, inf
    before. written: flat, takes every cell whose g was written (for a cheap reset). Returns how many these
    are.
    """
    fine = LEVELS if goal >= 0 else 1
    head = np.full(1 << math.ceil(math.log2((2 * SQRT2 * heaviest + 4.0) * fine)), -1, np.int32)
    # a cell waits at most once for each of its neighbours; memory never touched costs nothing
    cell, after = np.empty(8 * weight.shape[0], np.int32), np.empty(8 * weight.shape[0], np.int32)
    key = np.empty(cell.shape[0], np.float32)
    state = np.array([0, -1, 1, 0])
    g[source], written[0] = 0.0, source
    bucket = _level(np.float32(0.0), source, goal, stride)
    _push(source, np.float32(0.0), bucket, head, cell, key, after, state)
    while state[WAITING] > 0:
        slot = bucket & (head.shape[0] - 1)
        while head[slot] >= 0:
            entry = head[slot]
            at = np.int64(cell[entry])
            head[slot] = after[entry]
            after[entry] = state[SPENT]
            state[SPENT] = entry
            state[WAITING] -= 1
            if key[entry] == g[at]:  # else it was expanded since, at a lower cost
                _expand(at, bucket, weight, stride, goal, g, written, head, cell, key, after, state)
        if goal >= 0 and g[goal] * fine < bucket + 1:
            break
        bucket += 1
    return state[WRITTEN]


@njit(cache=True, nogil=True)
def descend(weight: NDArray[np.float32], stride: int, goal: int, g: NDArray[np.float32]) -> NDArray[np.int64]:
    """The cells of the way from the source (g = 0) to `goal`, in that order."""
    steps = np.array([1, -1, stride, -stride, 1 + stride, -1 + stride, 1 - stride, -1 - stride])
    way = [goal]
    at = goal
    while g[at] > 0.0:
        best, least = at, np.inf
        for k in range(8):
            n = at + steps[k]
            vertical, sideways = stride if k < 6 else -stride, 1 if k % 2 == 0 else -1
            if k > 3 and min(weight[at + vertical], weight[at + sideways]) == 0.0:
                continue
            cost = g[n] + (HALF if k < 4 else HALF_DIAGONAL) * (weight[at] + weight[n])
            if g[n] < g[at] and cost < least:
                best, least = n, cost
        at = best
        way.append(at)
    return np.array(way[::-1])
