"""Shortest ways over a costmap: A* and Dijkstra on the eight-connected grid.

A step costs its length in cells times the mean weight of its two cells; a weight is at least 1, and 0 says
blocked. A diagonal step is open only if both cells beside it are (no corner is cut). The open list is a
ring of buckets (Dial 1969): for Dijkstra one unit wide, the least that a step costs, so that what is taken
from a bucket is final; for A* (Hart, Nilsson & Raphael 1968) wider, so that most cells that are improved while
they wait stay in their bucket, and a cell that is improved once it was taken is taken again. First in, first
out: taken from the end, a long line of cells is followed at a cost that the next entry makes worthless. The octile
distance is consistent because no weight is below 1; the search ends when the goal's bucket is empty, so the cost
found is the least.

One kernel, and unsigned indices: arrays passed on for every cell, or a look at each index whether it counts from the
end, cost more than the work itself.
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
PER_UNIT = np.float32(0.5)
"""Buckets of A* for a unit of cost. Half or twice as many take 5 % longer, sixteen a quarter longer."""
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


@njit(cache=True, nogil=True)
def _open_list(
    cells: int, slots: int, source: int, slot: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Ring of `slots` buckets: lists of entries, of which the first `slots` are their heads; `source` is in `slot`.

    Returns the cell and the successor (-1 for none) of each entry, and the last entry of each bucket. A cell waits at
    most twice for each of its neighbours, and memory never touched costs nothing.
    """
    after, last = np.empty(slots + 16 * cells, np.int32), np.arange(slots).astype(np.int32)
    cell = np.empty(len(after), np.int32)
    after[: slots + 1] = -1
    cell[slots], after[slot], last[slot] = source, slots, slots
    return cell, after, last


@njit(cache=True, nogil=True)
def _to_neighbours(stride: int) -> tuple[NDArray[np.uint64], NDArray[np.uint64], NDArray[np.uint64]]:
    """What to add to a cell's index for its neighbours, and for the two cells beside each diagonal step."""
    down, right = np.array(DOWN) * stride, np.array(RIGHT)
    return (down + right).astype(np.uint64), down.astype(np.uint64), right.astype(np.uint64)


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
    written, and how often one was taken from the open list.
    """
    fine, towards = (PER_UNIT, np.float32(1.0)) if goal >= 0 else (np.float32(1.0), np.float32(0.0))
    slots = 1 << math.ceil(math.log2((2 * SQRT2 * heaviest + 4.0) * fine + 2.0))
    offset, above, beside = _to_neighbours(stride)
    down, right, better = np.array(DOWN), np.array(RIGHT), np.empty(8, np.uint64)
    to_row, to_column = np.int32(goal // stride), np.int32(goal % stride)
    # the source waits alone, in the bucket of its estimate
    bucket = int(towards * _octile(source // stride, source % stride, to_row, to_column) * fine)
    cell, after, last = _open_list(weight.shape[0], slots, source, bucket & (slots - 1))
    g[source], written[0], found, taken, used, spent, waiting = 0.0, source, 1, 0, slots + 1, -1, 1
    while waiting > 0 and (goal < 0 or g[goal] * fine >= bucket):
        slot = bucket & (slots - 1)
        while after[slot] >= 0:
            # the cell that waits longest; its entry is free now
            entry = after[slot]
            at, after[slot], after[entry], spent = np.uint64(cell[entry]), after[entry], spent, entry
            if after[slot] < 0:
                last[slot] = slot
            waiting, taken = waiting - 1, taken + 1
            row, column = np.int32(at) // np.int32(stride), np.int32(at) % np.int32(stride)
            cost, here = g[at], weight[at]
            if int((cost + towards * _octile(row, column, to_row, to_column)) * ROUNDED * fine) < bucket:
                continue  # it was taken since, in an earlier bucket
            for i in range(_improved(at, cost, here, np.uint64(stride), weight, g, better)):
                k = better[np.uint64(i)]
                n = at + offset[k]
                if k > 3 and _cuts_corner(weight, at + above[k], at + beside[k]):
                    continue
                # reached for the first time, or at a lower cost
                before, reached = g[n], cost + (HALF if k < 4 else HALF_DIAGONAL) * (here + weight[n])
                g[n] = reached
                ahead = towards * _octile(row + down[k], column + right[k], to_row, to_column)
                later = max(int((reached + ahead) * fine), bucket)
                if before == np.inf:
                    written[found] = n
                    found += 1
                elif later > bucket and later == int((before + ahead) * fine):
                    continue  # it waits there already
                # it waits in a new entry, or in one that is spent
                entry, used = (used, used + 1) if spent < 0 else (spent, used)
                spent = after[entry] if spent >= 0 else -1
                line = later & (slots - 1)
                cell[entry], after[entry], after[last[line]], last[line] = n, -1, entry, entry
                waiting += 1
        bucket += 1
    return found, taken


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
