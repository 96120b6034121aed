"""The part of a map that has changed since an earlier state of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import Grid


class MapPatch(NamedTuple):
    """A rectangle of a grid: the row and the column of its first cell, and its cells (height, width)."""

    row: int
    column: int
    cells: NDArray[np.int8]


def changed_part(before: Grid, now: Grid) -> MapPatch | None:
    """Return the smallest rectangle with all cells that differ, empty if none does.

    None if the grids do not have the same cells: one has grown, moved or has another resolution.
    """
    if not _same_geometry(before, now):
        return None
    differs = before.cells != now.cells
    rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if not len(rows):
        return MapPatch(0, 0, now.cells[:0, :0])
    row, column = int(rows[0]), int(columns[0])
    return MapPatch(row, column, now.cells[row : rows[-1] + 1, column : columns[-1] + 1])


def _same_geometry(one: Grid, other: Grid) -> bool:
    here = one.cells.shape, one.resolution, one.origin_x, one.origin_y
    return here == (other.cells.shape, other.resolution, other.origin_x, other.origin_y)
