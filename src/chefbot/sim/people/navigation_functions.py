"""Navigation functions: the length of the path to a destination from everywhere on the floor."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.sim.people.distance_field import Field, Floats, distance_at, line_is_clear

UNREACHABLE = 2**30
STRAIGHT, DIAGONAL = 10, 14
"""Cost of a step to a neighbouring cell in the open; 14 / 10 is near the square root of 2."""
ROOM = 0.6
"""Metres to obstacles beyond which people do not look for more."""
NARROW_FACTOR = 3.0
"""Cost of a step where a person just fits, relative to one in the open."""
LOOKAHEAD = 12
"""Cells of the path that a person looks ahead for a shortcut."""


@njit(cache=True, nogil=True)
def step_weights(
    field: Field, frame: Floats, path_frame: Floats, radius: float, out: NDArray[np.int32]
) -> None:
    """Write the cost of a straight step into each cell (H, W), 0 where a person of `radius` metres does not fit."""
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            x = path_frame[0] + (column + 0.5) * path_frame[2]
            y = path_frame[1] + (row + 0.5) * path_frame[2]
            free = distance_at(field, frame, x, y)
            if free < radius:
                out[row, column] = 0
            else:
                tight = max(ROOM - free, 0.0) / (ROOM - radius)
                out[row, column] = int(STRAIGHT * (1.0 + (NARROW_FACTOR - 1.0) * tight))


@njit(cache=True, nogil=True)
def spread(weights: NDArray[np.int32], row: int, column: int, out: NDArray[np.int32]) -> None:
    """Write the cost of the cheapest path from each cell (H, W) to the cell (row, column).

    Label correcting with a queue (Bellman 1958): whole numbers, so that the result does not depend on the order.
    """
    h, w = weights.shape
    out[:, :] = UNREACHABLE
    queue, waiting = np.empty(h * w, np.int32), np.zeros(h * w, np.bool_)
    out[row, column] = 0
    queue[0], first, count = row * w + column, 0, 1
    while count > 0:
        cell = queue[first]
        first, count = (first + 1) % (h * w), count - 1
        waiting[cell] = False
        r, c = cell // w, cell % w
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                nr, nc = r + dr, c + dc
                if not (0 <= nr < h and 0 <= nc < w) or weights[nr, nc] == 0:
                    continue
                # A diagonal step must not cut a corner.
                if dr != 0 and dc != 0 and (weights[r, nc] == 0 or weights[nr, c] == 0):
                    continue
                step = weights[nr, nc] * (DIAGONAL if dr != 0 and dc != 0 else STRAIGHT) // STRAIGHT
                if out[r, c] + step < out[nr, nc]:
                    out[nr, nc] = out[r, c] + step
                    if not waiting[nr * w + nc]:
                        waiting[nr * w + nc] = True
                        queue[(first + count) % (h * w)] = nr * w + nc
                        count += 1


@njit(cache=True, nogil=True)
def path_cost(costs: NDArray[np.int32], path_frame: Floats, x: float, y: float) -> int:
    """Return the cost of the path from (x, y), from the best of the cells around; UNREACHABLE if there is none."""
    row, column = _cell(path_frame, x, y)
    best = UNREACHABLE
    for r in range(max(row - 1, 0), min(row + 2, costs.shape[0])):
        for c in range(max(column - 1, 0), min(column + 2, costs.shape[1])):
            best = min(best, costs[r, c])
    return best


@njit(cache=True, nogil=True)
def next_point(
    costs: NDArray[np.int32],
    path_frame: Floats,
    field: Field,
    frame: Floats,
    x: float,
    y: float,
    radius: float,
) -> tuple[float, float]:
    """Return the farthest point of the path from (x, y) that can be walked to straight; (x, y) if there is none."""
    rows, columns = np.empty(LOOKAHEAD, np.int64), np.empty(LOOKAHEAD, np.int64)
    row, column = _cell(path_frame, x, y)
    # Steepest descent of the navigation function.
    count = 0
    here = UNREACHABLE
    while count < LOOKAHEAD:
        best, br, bc = here, row, column
        for r in range(max(row - 1, 0), min(row + 2, costs.shape[0])):
            for c in range(max(column - 1, 0), min(column + 2, costs.shape[1])):
                if costs[r, c] < best:
                    best, br, bc = costs[r, c], r, c
        if best >= here:
            break
        here, row, column = best, br, bc
        rows[count], columns[count] = row, column
        count += 1
    # The farthest cell in sight, else the next one.
    for k in range(count - 1, -1, -1):
        px = path_frame[0] + (columns[k] + 0.5) * path_frame[2]
        py = path_frame[1] + (rows[k] + 0.5) * path_frame[2]
        if k == 0 or line_is_clear(field, frame, x, y, px, py, radius):
            return px, py
    return x, y


@njit(cache=True, nogil=True)
def _cell(path_frame: Floats, x: float, y: float) -> tuple[int, int]:
    """Return row and column of the cell that contains a point."""
    row, column = (
        math.floor((y - path_frame[1]) / path_frame[2]),
        math.floor((x - path_frame[0]) / path_frame[2]),
    )
    return row, column
