"""Frontiers: free cells beside the unknown (Yamauchi 1997)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import UNKNOWN, Grid


class Frontier(NamedTuple):
    """A connected stretch of the border between free and unknown.

    cells: (n, 2) rows and columns. x, y: metres, the cell nearest to the middle. length: metres.
    """

    cells: NDArray[np.int64]
    x: float
    y: float
    length: float


def frontier_mask(grid: Grid, free_below: int) -> NDArray[np.bool_]:
    """Free cells (h, w) with an unknown one above, below, left or right."""
    unknown = grid.cells == UNKNOWN
    beside = np.zeros_like(unknown)
    beside[1:] |= unknown[:-1]
    beside[:-1] |= unknown[1:]
    beside[:, 1:] |= unknown[:, :-1]
    beside[:, :-1] |= unknown[:, 1:]
    result: NDArray[np.bool_] = beside & ~unknown & (grid.cells < free_below)
    return result


def find_frontiers(grid: Grid, free_below: int, longest: float) -> list[Frontier]:
    """All frontiers in the order of the grid's rows; those longer than `longest` metres in pieces."""
    from scipy import ndimage  # takes half a second, and the first picture does not need it

    labels, count = ndimage.label(frontier_mask(grid, free_below), structure=np.ones((3, 3)))
    cells = np.argwhere(labels)
    label = labels[cells[:, 0], cells[:, 1]]
    order = np.argsort(label, kind="stable")
    groups = np.split(cells[order], np.searchsorted(label[order], np.arange(2, count + 1)))
    return [
        _frontier(grid, piece) for group in groups if len(group) for piece in _pieces(grid, group, longest)
    ]


def _pieces(grid: Grid, cells: NDArray[np.int64], longest: float) -> list[NDArray[np.int64]]:
    """Cut across the main axis into pieces of about equal extent."""
    centred = cells - cells.mean(axis=0)
    axis = np.linalg.eigh(centred.T @ centred)[1][:, -1]
    along = centred @ axis
    extent = float(np.ptp(along)) * grid.resolution
    count = max(1, math.ceil(extent / longest))
    if count == 1:
        return [cells]
    part = np.minimum(((along - along.min()) / np.ptp(along) * count).astype(int), count - 1)
    return [cells[part == k] for k in range(count) if (part == k).any()]


def _frontier(grid: Grid, cells: NDArray[np.int64]) -> Frontier:
    middle = cells[np.argmin(((cells - cells.mean(axis=0)) ** 2).sum(axis=1))]
    x, y = grid.centre(int(middle[0]), int(middle[1]))
    extent = float(np.hypot(*(np.ptp(cells, axis=0) + 1)))
    return Frontier(cells, x, y, extent * grid.resolution)
