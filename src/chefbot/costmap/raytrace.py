"""Marking and clearing along beams (Moravec & Elfes 1985, reduced to free, occupied and unknown)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.beams import FULL_TURN
from chefbot.maths.costs import FREE, LETHAL

FRACTION_BITS = 20
"""Fractional bits of the fixed-point cell coordinates."""
CELL_DIAGONAL = math.sqrt(2.0)
"""Maximum distance of a point in a cell from a beam that crosses the cell, cells."""
MIDDLE_SHARE = 0.25
"""Distance of a beam from the border of the view, as a share of it, from which on it clears everything: there has to
be one, in a narrow view too."""
MAX_COORDINATE = 1e9
"""Maximum coordinate in cells; its product with any number of steps fits into 64 bits."""


@njit(cache=True, nogil=True)
def _clip_steps(p: int, d: int, top: int, first: int, last: int) -> tuple[int, int]:
    """Return the range of steps k within [first, last) for which 0 <= p + k d < top."""
    if d == 0:
        return (first, last) if 0 <= p < top else (first, first)
    if d > 0:
        return max(first, -(p // d)), min(last, -((p - top) // d))
    return max(first, (p - top) // -d + 1), min(last, p // -d + 1)


@njit(cache=True, nogil=True)
def _clear_line(
    cells: NDArray[np.uint8],
    also: NDArray[np.uint8],
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    start: float,
    margin: float,
) -> None:
    """Write FREE into both layers from (x0, y0) up to but not into the cell of (x1, y1); coordinates in cells.

    start: distance of (x0, y0) from the sensor, cells. margin: angle to the border of the view, rad. A lethal cell
    that may extend over the border stays: what is in it may be where no beam looks.

    A digital differential analyser (DDA) in fixed point: one step along the longer axis per cell, clipped to the
    map, so that a beam from far outside takes no longer than one within.
    """
    h, w = cells.shape
    # ignore beams that are not finite or exceed the range of fixed point; max(1.0, nan) is 1.0, so one at a time
    for coordinate in (x0, y0, x1, y1):
        if not abs(coordinate) < MAX_COORDINATE:
            return
    steps = int(max(abs(math.floor(x1) - math.floor(x0)), abs(math.floor(y1) - math.floor(y0))))
    if steps == 0:
        return
    # start and increment per step of both axes, in fixed point
    fixed_one = 1 << FRACTION_BITS
    x, y = int(x0 * fixed_one), int(y0 * fixed_one)
    dx, dy = int((x1 - x0) / steps * fixed_one), int((y1 - y0) / steps * fixed_one)
    # of lethal cells, clear those that are within the view from the first step on at which the border is far enough
    spared = float(steps) if margin <= 0.0 else 0.0
    if 0.0 < margin < math.inf:
        length = math.hypot(x1 - x0, y1 - y0)
        spared = (CELL_DIAGONAL / margin - start) / length * steps
    # clip to the steps within the map
    first, last = _clip_steps(x, dx, w * fixed_one, 0, steps)
    first, last = _clip_steps(y, dy, h * fixed_one, first, last)
    end_c, end_r = math.floor(x1), math.floor(y1)
    # walk along the line, sparing the cell of the end point
    x += first * dx
    y += first * dy
    for k in range(first, last):
        c, r = x >> FRACTION_BITS, y >> FRACTION_BITS
        is_spared = k < spared and (cells[r, c] == LETHAL or also[r, c] == LETHAL)
        if not (is_spared or (c == end_c and r == end_r)):
            cells[r, c] = FREE
            also[r, c] = FREE
        x += dx
        y += dy


@njit(cache=True, nogil=True)
def _measured_beams(mark: NDArray[np.float64], clear: NDArray[np.float64]) -> tuple[int, int]:
    """Return the first and the last beam that marks or clears, the borders of the view; first > last if none does."""
    first, last = 0, len(clear) - 1
    while first <= last and not (clear[first] > 0.0 or math.isfinite(mark[first])):
        first += 1
    while last > first and not (clear[last] > 0.0 or math.isfinite(mark[last])):
        last -= 1
    return first, last


@njit(cache=True, nogil=True)
def _border_margin(angles: NDArray[np.float64], first: int, last: int, i: int) -> float:
    """Return the angle from beam i to the nearer border of the view, rad; inf in its middle and in a full turn."""
    width = abs(angles[last] - angles[first])
    margin = min(abs(angles[i] - angles[first]), abs(angles[last] - angles[i]))
    has_border = last > first and width + 1.5 * width / (last - first) < FULL_TURN
    return margin if has_border and margin < MIDDLE_SHARE * width else math.inf


@njit(cache=True, nogil=True)
def limit_beams(
    ranges: NDArray[np.float64],
    clear_from: NDArray[np.float64],
    clear_to: NDArray[np.float64],
    marking_range: float,
    clearing_range: float,
    mark: NDArray[np.float64],
    clear: NDArray[np.float64],
) -> float:
    """Fill mark and clear (n,) as `mark_and_clear` takes them, and return the largest finite range in them, m.

    ranges: (n,) m, NaN or <= 0 for invalid ones. clear_from, clear_to: (n,) range interval known to be free, m;
    without them, (0,), a beam clears up to its range, inf too.
    """
    longest = 0.0
    for i in range(len(ranges)):
        valid = ranges[i] > 0.0
        mark[i] = ranges[i] if valid and ranges[i] <= marking_range else np.nan
        if len(clear_to) == 0:
            end, start = ranges[i] if valid else 0.0, 0.0
        else:
            end, start = clear_to[i] if math.isfinite(clear_to[i]) else 0.0, clear_from[i]
        clear[i] = min(end, clearing_range)
        for metres in (mark[i], start, clear[i]):
            if math.isfinite(metres):
                longest = max(longest, abs(metres))
    return longest


@njit(cache=True, nogil=True)
def mark_and_clear(
    cells: NDArray[np.uint8],
    resolution: float,
    origin_x: float,
    origin_y: float,
    sensor: NDArray[np.float64],
    angles: NDArray[np.float64],
    mark: NDArray[np.float64],
    clear_from: NDArray[np.float64],
    clear: NDArray[np.float64],
    also: NDArray[np.uint8],
    marked_at: NDArray[np.float64],
    time: float,
) -> None:
    """Clear along every beam, then mark every return, so that no beam erases a return of its neighbour.

    At the border of the view a wall beside the sensor has no neighbour that marks it again, so that it stays.

    sensor: x, y, yaw in the map's frame. angles: (n,) rad in the sensor's frame. mark: (n,) range of the obstacle, m,
    not finite for none. clear_from, clear: (n,) range interval known to be free, m, clear <= 0 for none. also:
    another layer, cleared along the beams but not marked; `cells` for none. marked_at: (h, w), gets `time` (s) where
    a cell is marked.
    """
    h, w = cells.shape
    x0, y0 = (sensor[0] - origin_x) / resolution, (sensor[1] - origin_y) / resolution
    first, last = _measured_beams(mark, clear)
    # clear the free interval of every beam
    for i in range(angles.shape[0]):
        if clear[i] > 0.0 and clear_from[i] < clear[i]:
            c, s = math.cos(sensor[2] + angles[i]) / resolution, math.sin(sensor[2] + angles[i]) / resolution
            near, far = clear_from[i], clear[i]
            ends = (x0 + near * c, y0 + near * s, x0 + far * c, y0 + far * s)
            _clear_line(cells, also, *ends, near / resolution, _border_margin(angles, first, last, i))
    # mark the end point of every return
    for i in range(angles.shape[0]):
        a, reach = sensor[2] + angles[i], mark[i] / resolution
        if math.isfinite(a) and math.isfinite(reach) and reach > 0.0:
            c = math.floor(x0 + reach * math.cos(a))
            r = math.floor(y0 + reach * math.sin(a))
            if 0 <= r < h and 0 <= c < w:
                cells[r, c] = LETHAL
                if r < marked_at.shape[0] and c < marked_at.shape[1]:
                    marked_at[r, c] = time
