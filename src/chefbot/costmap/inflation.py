"""Costs around obstacles, from the exact Euclidean distance to the nearest lethal cell.

The distance transform is separable (Saito & Toriwaki 1994): first along the columns, then, for every row,
the least of `g(column + k)^2 + k^2`. Both passes stop at the inflation radius, work on 16-bit integers that
the compiler puts into vectors, and skip stretches of a row with nothing near.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN

BLOCK = 64
MAX_RADIUS_CELLS = 180
"""Twice its square must fit into 16 bits."""


def cost_table(
    resolution: float, inscribed_radius: float, inflation_radius: float, cost_scaling_factor: float
) -> NDArray[np.uint8]:
    """Cost by squared distance in cells, from 0 to the inflation radius (as Nav2's
    InflationLayer::computeCost).

    254 at 0, 253 up to `inscribed_radius`, then 252 exp(-cost_scaling_factor (d - inscribed_radius));
    metres, 1/m.
    """
    reach = min(inflation_radius / resolution + 1e-9, MAX_RADIUS_CELLS)
    distance = np.sqrt(np.arange(int(reach * reach) + 1)) * resolution
    decayed = (INSCRIBED - 1) * np.exp(-cost_scaling_factor * (distance - inscribed_radius))
    table = np.where(distance <= inscribed_radius, INSCRIBED, np.minimum(decayed, INSCRIBED - 1))
    table[0] = LETHAL
    return table.astype(np.uint8)


def inflate(cells: NDArray[np.uint8], table: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A copy of `cells` (h, w) in which every cell costs at least what its nearest lethal cell asks for.

    An unknown cell stays unknown unless it is within the inscribed radius of a lethal one.
    """
    reach = math.isqrt(len(table) - 1)
    out = cells.copy()
    if cells.size:
        _spread(cells, _column_distance(cells, reach), table, reach, out)
    return out


@njit(cache=True, nogil=True)
def _column_distance(cells: NDArray[np.uint8], reach: int) -> NDArray[np.uint16]:
    """Cells to the nearest lethal one in the same column, `reach + 1` when further; padded by `reach`
    columns."""
    h, w = cells.shape
    far = np.uint16(reach + 1)
    g = np.empty((h, w + 2 * reach), np.uint16)
    g[:, :reach] = far
    g[:, w + reach :] = far
    for r in range(h):
        row, out, above = cells[r], g[r, reach : reach + w], g[max(r - 1, 0), reach : reach + w]
        for c in range(w):
            d = np.uint16(above[c] + 1) if r > 0 else far
            d = far if d > far else d
            out[c] = np.uint16(0) if row[c] == LETHAL else d
    for r in range(h - 2, -1, -1):
        out, below = g[r, reach : reach + w], g[r + 1, reach : reach + w]
        for c in range(w):
            d = np.uint16(below[c] + 1)
            out[c] = d if d < out[c] else out[c]
    return g


@njit(cache=True, nogil=True)
def _row_minimum(g: NDArray[np.uint16], start: int, n: int, reach: int, best: NDArray[np.uint16]) -> None:
    """best[i] = min over k of g[start + i + k]^2 + (k - reach)^2, squared cells."""
    for i in range(n):
        best[i] = np.uint16(65535)
    for k in range(2 * reach + 1):
        offset = np.uint16((k - reach) * (k - reach))
        shifted = g[start + k : start + k + n]
        for i in range(n):
            v = np.uint16(shifted[i] + offset)
            best[i] = v if v < best[i] else best[i]


@njit(cache=True, nogil=True)
def _spread(
    cells: NDArray[np.uint8],
    g: NDArray[np.uint16],
    table: NDArray[np.uint8],
    reach: int,
    out: NDArray[np.uint8],
) -> None:
    """Second pass and the table, block by block; a block with nothing lethal within reach stays as it is."""
    h, w = cells.shape
    far = np.uint16(reach + 1)
    squares = np.empty(w + 2 * reach, np.uint16)
    best = np.empty(BLOCK, np.uint16)
    for r in range(h):
        row = g[r]
        for i in range(row.shape[0]):
            squares[i] = np.uint16(row[i] * row[i])
        for start in range(0, w, BLOCK):
            n = min(BLOCK, w - start)
            nearest = far
            for i in range(start, start + n + 2 * reach):
                nearest = row[i] if row[i] < nearest else nearest
            if nearest < far:
                _row_minimum(squares, start, n, reach, best)
                _raise_costs(cells[r, start : start + n], best, table, out[r, start : start + n])


@njit(cache=True, nogil=True)
def _raise_costs(
    cells: NDArray[np.uint8], best: NDArray[np.uint16], table: NDArray[np.uint8], out: NDArray[np.uint8]
) -> None:
    for i in range(cells.shape[0]):
        if best[i] < table.shape[0]:
            cost, old = table[best[i]], cells[i]
            if old == UNKNOWN:
                out[i] = cost if cost >= INSCRIBED else old
            else:
                out[i] = cost if cost > old else old
