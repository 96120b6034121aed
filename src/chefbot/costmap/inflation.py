"""Costs around obstacles, from the exact Euclidean distance to the nearest lethal cell.

The distance transform is separable (Saito & Toriwaki 1994): first along the columns, then, for every row,
the minimum of `g(column + k)^2 + k^2` over k. Both passes stop at the inflation radius, use 16-bit integers that
the compiler vectorizes, and skip blocks of a row without an obstacle near them.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN

BLOCK = 64
"""Cells of a row that are processed together."""
MAX_RADIUS_CELLS = 180
"""Maximum inflation radius in cells: twice its square must fit into 16 bits."""


def cost_table(
    resolution: float, inscribed_radius: float, inflation_radius: float, cost_scaling_factor: float
) -> NDArray[np.uint8]:
    """Return the cost by squared distance in cells, up to the inflation radius (Nav2's InflationLayer::computeCost).

    254 at 0, 253 up to `inscribed_radius`, then 252 exp(-cost_scaling_factor (d - inscribed_radius));
    radii and resolution in m, cost_scaling_factor in 1/m.
    """
    radius = min(inflation_radius / resolution + 1e-9, MAX_RADIUS_CELLS)
    distance = np.sqrt(np.arange(int(radius * radius) + 1)) * resolution
    decayed = (INSCRIBED - 1) * np.exp(-cost_scaling_factor * (distance - inscribed_radius))
    table = np.where(distance <= inscribed_radius, INSCRIBED, np.minimum(decayed, INSCRIBED - 1))
    table[0] = LETHAL
    return table.astype(np.uint8)


def inflate(cells: NDArray[np.uint8], table: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a copy of `cells` (h, w) in which every cell costs at least `table` at its distance to a lethal cell.

    An unknown cell stays unknown unless it is within the inscribed radius of a lethal cell.
    """
    radius = math.isqrt(len(table) - 1)
    out = cells.copy()
    if cells.size:
        _inflate_rows(cells, _column_distance(cells, radius), table, radius, out)
    return out


@njit(cache=True, nogil=True)
def _column_distance(cells: NDArray[np.uint8], radius: int) -> NDArray[np.uint16]:
    """Return the distance in cells to the nearest lethal cell of the same column, at most `radius + 1`.

    The result is padded by `radius` columns on both sides.
    """
    h, w = cells.shape
    beyond = np.uint16(radius + 1)
    g = np.empty((h, w + 2 * radius), np.uint16)
    g[:, :radius] = beyond
    g[:, w + radius :] = beyond
    # downward: distance to the nearest lethal cell above
    for r in range(h):
        row, out, above = cells[r], g[r, radius : radius + w], g[max(r - 1, 0), radius : radius + w]
        for c in range(w):
            d = np.uint16(above[c] + 1) if r > 0 else beyond
            d = beyond if d > beyond else d
            out[c] = np.uint16(0) if row[c] == LETHAL else d
    # upward: the minimum with the distance to the nearest one below
    for r in range(h - 2, -1, -1):
        out, below = g[r, radius : radius + w], g[r + 1, radius : radius + w]
        for c in range(w):
            d = np.uint16(below[c] + 1)
            out[c] = d if d < out[c] else out[c]
    return g


@njit(cache=True, nogil=True)
def _row_minimum(g: NDArray[np.uint16], start: int, n: int, radius: int, best: NDArray[np.uint16]) -> None:
    """Compute best[i] = min over k of g[start + i + k] + (k - radius)^2, in squared cells; g is squared already."""
    for i in range(n):
        best[i] = np.uint16(65535)
    for k in range(2 * radius + 1):
        offset = np.uint16((k - radius) * (k - radius))
        shifted = g[start + k : start + k + n]
        for i in range(n):
            v = np.uint16(shifted[i] + offset)
            best[i] = v if v < best[i] else best[i]


@njit(cache=True, nogil=True)
def _inflate_rows(
    cells: NDArray[np.uint8],
    g: NDArray[np.uint16],
    table: NDArray[np.uint8],
    radius: int,
    out: NDArray[np.uint8],
) -> None:
    """Run the row pass and look up the costs, skipping blocks with nothing lethal within the radius."""
    h, w = cells.shape
    beyond = np.uint16(radius + 1)
    squares = np.empty(w + 2 * radius, np.uint16)
    best = np.empty(BLOCK, np.uint16)
    for r in range(h):
        # squared column distances of the row
        row = g[r]
        for i in range(row.shape[0]):
            squares[i] = np.uint16(row[i] * row[i])
        for start in range(0, w, BLOCK):
            n = min(BLOCK, w - start)
            # skip the block if no column within the radius has a lethal cell
            nearest = beyond
            for i in range(start, start + n + 2 * radius):
                nearest = row[i] if row[i] < nearest else nearest
            if nearest < beyond:
                _row_minimum(squares, start, n, radius, best)
                _raise_costs(cells[r, start : start + n], best, table, out[r, start : start + n])


@njit(cache=True, nogil=True)
def _raise_costs(
    cells: NDArray[np.uint8], best: NDArray[np.uint16], table: NDArray[np.uint8], out: NDArray[np.uint8]
) -> None:
    # the maximum of old and inflated cost; unknown cells only change within the inscribed radius
    for i in range(cells.shape[0]):
        if best[i] < table.shape[0]:
            cost, current = table[best[i]], cells[i]
            if current == UNKNOWN:
                out[i] = cost if cost >= INSCRIBED else current
            else:
                out[i] = cost if cost > current else current
