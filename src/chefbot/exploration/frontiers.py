"""Frontiers: the boundaries between free and unknown space (Yamauchi 1997)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import UNKNOWN, Grid


class Frontier(NamedTuple):
    """A connected section of the boundary between free and unknown space.

    cells: (n, 2) rows and columns. x, y: metres, the cell nearest to the centroid. length: metres.
    """

    cells: NDArray[np.int64]
    x: float
    y: float
    length: float


def frontier_mask(grid: Grid, free_threshold: int) -> NDArray[np.bool_]:
    """Return the free cells (h, w) with an unknown cell above, below, left or right."""
    from scipy import ndimage  # imported late: it takes half a second, and the first image does not need it

    unknown = grid.cells == UNKNOWN
    near_unknown = ndimage.binary_dilation(unknown)
    frontier: NDArray[np.bool_] = near_unknown & ~unknown & (grid.cells < free_threshold)
    return frontier


def find_frontiers(grid: Grid, free_threshold: int, max_frontier_length: float) -> list[Frontier]:
    """Return all frontiers in the order of the grid's rows; those longer than max_frontier_length (m) are split."""
    from scipy import ndimage

    # 8-connected components of the frontier cells
    labels, count = ndimage.label(frontier_mask(grid, free_threshold), structure=np.ones((3, 3)))
    cells = np.argwhere(labels)
    label = labels[cells[:, 0], cells[:, 1]]
    # Group the cells by component
    order = np.argsort(label, kind="stable")
    groups = np.split(cells[order], np.searchsorted(label[order], np.arange(2, count + 1)))
    return [
        _frontier(grid, piece)
        for group in groups
        if len(group)
        for piece in _pieces(grid, group, max_frontier_length)
    ]


def _pieces(grid: Grid, cells: NDArray[np.int64], max_frontier_length: float) -> list[NDArray[np.int64]]:
    """Split the cells across their main axis into pieces of about equal extent."""
    centred = cells - cells.mean(axis=0)
    # Principal axis: eigenvector of the largest eigenvalue
    axis = np.linalg.eigh(centred.T @ centred)[1][:, -1]
    along = centred @ axis
    extent = float(np.ptp(along)) * grid.resolution
    count = max(1, math.ceil(extent / max_frontier_length))
    if count == 1:
        return [cells]
    piece = np.minimum(((along - along.min()) / np.ptp(along) * count).astype(int), count - 1)
    return [cells[piece == k] for k in range(count) if (piece == k).any()]


def _frontier(grid: Grid, cells: NDArray[np.int64]) -> Frontier:
    centre_cell = cells[np.argmin(((cells - cells.mean(axis=0)) ** 2).sum(axis=1))]
    x, y = grid.centre(int(centre_cell[0]), int(centre_cell[1]))
    extent = float(np.hypot(*(np.ptp(cells, axis=0) + 1)))
    return Frontier(cells, x, y, extent * grid.resolution)
