"""Shortest ways over a costmap: A* and Dijkstra on the eight-connected grid.

A step costs its length in cells times the mean weight of its two cells; a weight is at least 1, and 0 says blocked.
A diagonal step is open only if both cells beside it are (no corner is cut). The open list is a ring of buckets one
unit wide (Dial 1969): the least step costs one unit, so what is taken from the current bucket is final, but for a
cell that is improved within the bucket, which is then simply taken again. With A* (Hart, Nilsson & Raphael 1968) the
octile distance is consistent because no weight is below 1; the search ends when the goal's bucket is empty, so the
cost found is the least.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

SQRT2 = math.sqrt(2.0)
LEVELS_AHEAD = 2 * SQRT2
"""A step raises the estimate of a cell by its cost and by at most as much again in the heuristic."""


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


@njit(cache=True, nogil=True, inline="always")
def _estimate(at: int, goal_row: int, goal_column: int, stride: int) -> float:
    """Octile distance, the least that any way to the goal can cost; 0 without a goal (row < 0)."""
    if goal_row < 0:
        return 0.0
    row = at // stride
    dr, dc = abs(row - goal_row), abs(at - row * stride - goal_column)
    return max(dr, dc) + (SQRT2 - 1.0) * min(dr, dc)


@njit(cache=True, nogil=True)
def _doubled(old: NDArray[np.int32]) -> NDArray[np.int32]:
    bigger = np.empty(2 * old.shape[0], np.int32)
    bigger[: old.shape[0]] = old
    return bigger


@njit(cache=True, nogil=True)
def search(
    cells: NDArray[np.uint8],
    weight: NDArray[np.float32],
    stride: int,
    source: int,
    goal: int,
    g: NDArray[np.float32],
    written: NDArray[np.int32],
) -> int:
    """Cost-to-come `g` from `source`, until `goal` is certain or, if `goal` < 0, everywhere.

    cells: flat grid with a blocked rim, rows of `stride` cells. weight: (256,) by cost. g: flat, inf before. written:
    flat, takes every cell whose g was written (for a cheap reset). Returns how many these are.
    """
    size = 1 << math.ceil(math.log2(LEVELS_AHEAD * weight.max() + 4.0))
    head = np.full(size, -1, np.int32)
    entry_cell, entry_next, free = np.empty(4096, np.int32), np.empty(4096, np.int32), -1
    steps = np.array([1, -1, stride, -stride, 1 + stride, 1 - stride, -1 + stride, -1 - stride])
    half = np.array([0.5] * 4 + [0.5 * SQRT2] * 4, np.float32)
    # a diagonal is open if the two straight steps beside it are
    open_to = np.zeros(8, np.float32)
    goal_row, goal_column = (goal // stride, goal % stride) if goal >= 0 else (-1, -1)
    bucket = int(_estimate(source, goal_row, goal_column, stride))
    g[source] = 0.0
    written[0] = source
    writes, used = 1, 1
    entry_cell[0], entry_next[0] = source, -1
    head[bucket % size] = 0
    waiting = 1
    while waiting > 0:
        slot = bucket & (size - 1)
        while head[slot] >= 0:
            entry = head[slot]
            at = entry_cell[entry]
            head[slot] = entry_next[entry]
            entry_next[entry], free = free, entry
            waiting -= 1
            g_at, w_at = g[at], weight[cells[at]]
            if int(g_at + _estimate(at, goal_row, goal_column, stride)) < bucket:
                continue  # expanded since, at a lower cost
            for k in range(8):
                n = at + steps[k]
                w = weight[cells[n]]
                if k < 4:
                    open_to[k] = w
                elif open_to[0 if k < 6 else 1] == 0 or open_to[2 if k % 2 == 0 else 3] == 0:
                    continue
                if w == 0:
                    continue
                candidate = np.float32(g_at + half[k] * (w_at + w))
                if candidate < g[n]:
                    if g[n] == np.inf:
                        written[writes] = n
                        writes += 1
                    g[n] = candidate
                    level = max(int(candidate + _estimate(n, goal_row, goal_column, stride)), bucket)
                    if free >= 0:
                        new, free = free, entry_next[free]
                    else:
                        if used == entry_cell.shape[0]:
                            entry_cell, entry_next = _doubled(entry_cell), _doubled(entry_next)
                        new = used
                        used += 1
                    entry_cell[new] = n
                    entry_next[new] = head[level & (size - 1)]
                    head[level & (size - 1)] = new
                    waiting += 1
        if goal >= 0 and g[goal] < bucket + 1:
            break
        bucket += 1
    return writes


@njit(cache=True, nogil=True)
def descend(
    cells: NDArray[np.uint8], weight: NDArray[np.float32], stride: int, goal: int, g: NDArray[np.float32]
) -> NDArray[np.int64]:
    """The cells of the way from the source (g = 0) to `goal`, in that order."""
    steps = np.array([1, -1, stride, -stride, 1 + stride, 1 - stride, -1 + stride, -1 - stride])
    way = [goal]
    at = goal
    while g[at] > 0.0:
        best, least = at, np.inf
        for k in range(8):
            n = at + steps[k]
            if g[n] < g[at]:
                if k > 3 and (weight[cells[at + steps[0 if k < 6 else 1]]] == 0):
                    continue
                if k > 3 and (weight[cells[at + steps[2 if k % 2 == 0 else 3]]] == 0):
                    continue
                half = 0.5 if k < 4 else 0.5 * SQRT2
                cost = g[n] + half * (weight[cells[at]] + weight[cells[n]])
                if cost < least:
                    best, least = n, cost
        at = best
        way.append(at)
    return np.array(way[::-1])
