"""Shortest ways over a costmap: A* and Dijkstra on the eight-connected grid.

A step costs its length in cells times the mean weight of its two cells; a weight is at least 1, and 0 says
blocked. A diagonal step is open only if both cells beside it are (no corner is cut). The open list is a
ring of buckets (Dial 1969): for Dijkstra one unit wide, the least that a step costs, so that what is taken
from a bucket is final; for A* (Hart, Nilsson & Raphael 1968) wider, so that most cells that are improved while
they wait stay in their bucket, and a cell that is improved once it was expanded is expanded again. First in, first
out: taken from the end, a long line of cells is followed at a cost that the next entry makes worthless. The octile
distance is consistent because no weight is below 1; the search ends when the goal's bucket is empty, so the cost
found is the least.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

SQRT2 = math.sqrt(2.0)
HALF = np.float32(0.5)
HALF_DIAGONAL = np.float32(0.5 * SQRT2)
OCTILE = np.float32(SQRT2 - 1.0)
WIDTH = 2.0
"""Cost in a bucket of A*. Half of it and twice of it take 5 % longer, a sixteenth a quarter longer."""
ROUNDED = np.float32(1.0 + 1e-6)
"""Times a sum in 32 bits: no less than the exact one."""
DOWN, RIGHT = (0, 0, 1, -1, 1, 1, -1, -1), (1, -1, 0, 0, 1, -1, 1, -1)
"""Rows and columns to the eight neighbours, the diagonal ones last."""


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
def clear(g: NDArray[np.float32], written: NDArray[np.int32], count: int) -> None:
    """Infinity for the first `count` cells of `written`."""
    for i in range(count):
        g[written[i]] = np.inf


@njit(cache=True, nogil=True, inline="always")
def _octile(row: int, column: int, goal_row: int, goal_column: int) -> np.float32:
    """The least that any way to the goal can cost."""
    dr, dc = abs(row - goal_row), abs(column - goal_column)
    return np.float32(max(dr, dc)) + OCTILE * np.float32(min(dr, dc))


@njit(cache=True, nogil=True, inline="always")
def _improves(
    n: int,
    cost: np.float32,
    half: np.float32,
    here: np.float32,
    weight: NDArray[np.float32],
    g: NDArray[np.float32],
) -> int:
    """1 if the open cell n is cheaper to reach by a step of 2 * half from a cell of weight `here`, else 0."""
    return int((cost + half * (here + weight[n]) < g[n]) & (weight[n] > 0.0))


@njit(cache=True, nogil=True, inline="always")
def _take(
    slot: int, spent: int, first: NDArray[np.int32], cell: NDArray[np.int32], after: NDArray[np.int32]
) -> tuple[np.uint64, int]:
    """The cell that waits longest in a bucket, and the entry that is free now, `spent` behind it."""
    entry = first[slot]
    first[slot], after[entry] = after[entry], spent
    return np.uint64(cell[entry]), entry


@njit(cache=True, nogil=True, inline="always")
def _cuts_corner(weight: NDArray[np.float32], one: np.uint64, other: np.uint64) -> bool:
    """Whether a cell beside a diagonal step is blocked."""
    return min(weight[one], weight[other]) == 0.0


@njit(cache=True, nogil=True, inline="always")
def _improved(
    at: np.uint64,
    cost: np.float32,
    here: np.float32,
    row_on: np.uint64,
    weight: NDArray[np.float32],
    g: NDArray[np.float32],
    better: NDArray[np.uint64],
) -> int:
    """Into `better`, in the order of DOWN and RIGHT, the neighbours that cell `at` improves; returns how many.

    Without branches, which could not be predicted: mostly it is one.
    """
    one, hits = np.uint64(1), 0
    better[hits] = 0
    hits += _improves(at + one, cost, HALF, here, weight, g)
    better[hits] = 1
    hits += _improves(at - one, cost, HALF, here, weight, g)
    better[hits] = 2
    hits += _improves(at + row_on, cost, HALF, here, weight, g)
    better[hits] = 3
    hits += _improves(at - row_on, cost, HALF, here, weight, g)
    better[hits] = 4
    hits += _improves(at + row_on + one, cost, HALF_DIAGONAL, here, weight, g)
    better[hits] = 5
    hits += _improves(at + row_on - one, cost, HALF_DIAGONAL, here, weight, g)
    better[hits] = 6
    hits += _improves(at - row_on + one, cost, HALF_DIAGONAL, here, weight, g)
    better[hits] = 7
    hits += _improves(at - row_on - one, cost, HALF_DIAGONAL, here, weight, g)
    return hits


@njit(cache=True, nogil=True)
def search(
    weight: NDArray[np.float32],
    heaviest: float,
    stride: int,
    source: int,
    goal: int,
    g: NDArray[np.float32],
    written: NDArray[np.int32],
) -> tuple[int, int]:
    """Cost-to-come `g` from `source`, until `goal` is certain or, if `goal` < 0, everywhere.

    weight: flat grid with a blocked rim, rows of `stride` cells, none above `heaviest`. g: flat, inf
    before. written: flat, takes every cell whose g was written (for a cheap reset). Returns how many were
    written, and how often one was expanded.

    One kernel, and unsigned indices: arrays passed on for every cell (the end of the open list alone, in a function
    of its own: a quarter), or a look at each index whether it counts from the end, cost more than the work itself.
    """
    fine, towards = (
        (np.float32(1.0 / WIDTH), np.float32(1.0)) if goal >= 0 else (np.float32(1.0), np.float32(0.0))
    )
    slots = 1 << math.ceil(math.log2((2 * SQRT2 * heaviest + 4.0) * fine + 2.0))
    # the open list: first and last entry of each bucket (-1 for none), cell and successor of each entry; a cell
    # waits at most twice for each of its neighbours, and memory never touched costs nothing
    room = 16 * weight.shape[0]
    first, last = np.full(slots, -1, np.int32), np.empty(slots, np.int32)
    cell, after = np.empty(room, np.int32), np.empty(room, np.int32)
    down, right, better = np.array(DOWN), np.array(RIGHT), np.empty(8, np.uint64)
    offset = (down * stride + right).astype(np.uint64)
    above, beside = (down * stride).astype(np.uint64), right.astype(np.uint64)
    to_row, to_column = np.int32(goal // stride), np.int32(goal % stride)
    # the source waits alone, in the bucket of its estimate
    row, column = np.int32(source // stride), np.int32(source % stride)
    bucket = int(towards * _octile(row, column, to_row, to_column) * fine)
    g[source], written[0], used, spent, found, expanded, waiting = 0.0, source, 1, -1, 1, 0, 1
    first[bucket & (slots - 1)] = last[bucket & (slots - 1)] = 0
    cell[0], after[0] = source, -1
    while waiting > 0 and (goal < 0 or g[goal] * fine >= bucket):
        slot = bucket & (slots - 1)
        while first[slot] >= 0:
            at, spent = _take(slot, spent, first, cell, after)
            waiting -= 1
            row = np.int32(at) // np.int32(stride)
            column = np.int32(at) - row * np.int32(stride)
            cost, here = g[at], weight[at]
            estimate = cost + towards * _octile(row, column, to_row, to_column)
            if int(estimate * ROUNDED * fine) < bucket:
                continue  # it was expanded since, in an earlier bucket
            expanded += 1
            for i in range(_improved(at, cost, here, np.uint64(stride), weight, g, better)):
                k = better[np.uint64(i)]
                n = at + offset[k]
                if k > 3 and _cuts_corner(weight, at + above[k], at + beside[k]):
                    continue
                # reached for the first time, or at a lower cost
                before, reached = g[n], cost + (HALF if k < 4 else HALF_DIAGONAL) * (here + weight[n])
                g[n] = reached
                ahead = towards * _octile(
                    np.int32(row + down[k]), np.int32(column + right[k]), to_row, to_column
                )
                later = max(int((reached + ahead) * fine), bucket)
                if before == np.inf:
                    written[found] = n
                    found += 1
                elif later > bucket and later == int((before + ahead) * fine):
                    continue  # it waits there already
                # it waits in the place of a spent entry if there is one
                entry = spent
                if entry >= 0:
                    spent = after[entry]
                else:
                    entry, used = used, used + 1
                cell[entry], after[entry] = n, -1
                line = later & (slots - 1)
                if first[line] < 0:
                    first[line] = entry
                else:
                    after[last[line]] = entry
                last[line] = entry
                waiting += 1
        bucket += 1
    return found, expanded


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
