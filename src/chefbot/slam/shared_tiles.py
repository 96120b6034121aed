"""The maps of all particles: tiles of cells shared between particles and copied on write.

A map cell stores the number of beams that ended in it and the mean of their ends (as gmapping does, Grisetti
et al. 2007): the mean locates a surface to a fraction of a cell. Cells without hits are all alike, so a map
is a table of tiles in which most entries are tile 0, the empty one. Resampling copies only the small tables;
a tile is copied when a particle writes to a tile that others use too.

Each tile repeats the outermost cells of its neighbours (a halo), so that the 3 x 3 cells around any of its
own cells lie in one tile and the scan matcher reads one table entry per beam.

Lengths are in cells, relative to the table's corner, or to the corner of a tile for the means.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.slam.cell_bounds import EMPTY_BOUNDS, cells_of

SHIFT = 4
SIDE = 1 << SHIFT
"""Side of a tile, cells."""
STRIDE = SIDE + 2
AREA = STRIDE * STRIDE
FAR_COORDINATE = np.float32(1e6)
"""Coordinate of the mean of a cell without hits: beyond the range of any beam."""
EMPTY = 0
_MARGIN = 16
"""Tiles added around a table that must grow, so that it rarely does."""

_T = TypeVar("_T", bound=np.generic)


class TileMaps:
    """One map for each of `particles` particles; `max_cells` limits the size of their bounding rectangle."""

    def __init__(self, particles: int, max_cells: int) -> None:
        self.table: NDArray[np.int32] = np.zeros((particles, 0, 0), np.int32)
        self._extent = EMPTY_BOUNDS
        """Bounding rectangle of the tables, tiles."""
        self._max_cells = max_cells
        self.mean_x: NDArray[np.float32] = np.full((256, AREA), FAR_COORDINATE, np.float32)
        self.mean_y: NDArray[np.float32] = np.full((256, AREA), FAR_COORDINATE, np.float32)
        self.hits: NDArray[np.int32] = np.zeros((256, AREA), np.int32)
        self._references: NDArray[np.int32] = np.zeros(256, np.int32)
        self._free = np.arange(255, 0, -1, dtype=np.int32)
        self._free_count = np.array([255])

    @property
    def tiles_in_use(self) -> int:
        """Number of tiles that hold cells, shared ones counted once."""
        return len(self._references) - 1 - int(self._free_count[0])

    @property
    def corner(self) -> NDArray[np.int64]:
        """Position (x, y) of the tables' corner, cells of the map frame."""
        return self._extent.begin * SIDE

    def grow_to(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Grow the tables to hold `low` to `high`, (x, y) in cells of the map frame, plus one tile.

        Raise MapSizeError if that takes more than `max_cells` cells.
        """
        first, last = cells_of(np.vstack([low, high])) // SIDE + np.array([[-1], [1]])
        if self._extent.contains(first, last):
            return
        extent = self._extent.expanded(first, last, np.full(2, _MARGIN))
        extent.scaled(SIDE).check_size(self._max_cells)
        self.table = self._extent.copied_into(self.table, extent)
        self._extent = extent

    def add(self, particle: int, ends: NDArray[np.float32]) -> None:
        """Insert the ends of beams, (n, 2) in cells relative to the table's corner; call `grow_to` before."""
        n_added = 0
        while n_added < len(ends):
            n_added = _add(
                ends, n_added, self.table[particle], self.mean_x, self.mean_y, self.hits,
                self._references, self._free, self._free_count,
            )  # fmt: skip
            if n_added < len(ends):
                self._allocate_tiles()

    def _allocate_tiles(self) -> None:
        old_size = len(self._references)
        new_size = old_size + old_size // 2
        self.mean_x = _extended(self.mean_x, new_size)
        self.mean_y = _extended(self.mean_y, new_size)
        self.hits = _extended(self.hits, new_size)
        self._references = _extended(self._references, new_size)
        free = np.empty(new_size, np.int32)
        n_free = int(self._free_count[0])
        free[: new_size - old_size] = np.arange(new_size - 1, old_size - 1, -1)
        free[new_size - old_size : new_size - old_size + n_free] = self._free[:n_free]
        self._free = free
        self._free_count[0] = n_free + new_size - old_size

    def resample(self, parents: NDArray[np.int64]) -> None:
        """Make particle i continue with the map of particle `parents[i]`."""
        self.table = np.ascontiguousarray(self.table[parents])
        _count(self.table, self._references, self._free, self._free_count)


def _extended(array: NDArray[_T], length: int) -> NDArray[_T]:
    longer = np.empty((length, *array.shape[1:]), array.dtype)
    longer[: len(array)] = array
    return longer


@njit(cache=True, nogil=True)
def _count(tables, references, free, free_count):  # type: ignore[no-untyped-def]
    """Recount the references to each tile, and list the tiles that are free."""
    references[:] = 0
    for tile in tables.flat:
        references[tile] += 1
    n = 0
    # Unreferenced tiles, except the empty one
    for tile in range(len(references) - 1, EMPTY, -1):
        if references[tile] == 0:
            free[n] = tile
            n += 1
    free_count[0] = n


@njit(cache=True, nogil=True)
def _writable(table, row, column, mean_x, mean_y, hits, references, free, free_count):  # type: ignore[no-untyped-def]
    """Return the tile at (row, column) for writing, after copying it if it is shared."""
    tile = table[row, column]
    if tile != EMPTY and references[tile] == 1:
        return tile
    free_count[0] -= 1
    # Copy on write: the particle gets a tile of its own
    copy = free[free_count[0]]
    for cell in range(AREA):
        mean_x[copy, cell], mean_y[copy, cell] = mean_x[tile, cell], mean_y[tile, cell]
        hits[copy, cell] = hits[tile, cell]
    if tile != EMPTY:
        references[tile] -= 1
    references[copy] = 1
    table[row, column] = copy
    return copy


@njit(cache=True, nogil=True)
def _add(ends, begin, table, mean_x, mean_y, hits, references, free, free_count):  # type: ignore[no-untyped-def]
    """Insert ends[begin:]; return the index reached when free tiles ran short."""
    for i in range(begin, len(ends)):
        # An end writes to up to four tiles: its own and three halos
        if free_count[0] < 4:
            return i
        # Tile of the end, and its cell in that tile
        x, y = ends[i, 0], ends[i, 1]
        column, row = int(np.floor(x)), int(np.floor(y))
        tile_row, tile_column = row >> SHIFT, column >> SHIFT
        row -= tile_row << SHIFT
        column -= tile_column << SHIFT
        tile = _writable(table, tile_row, tile_column, mean_x, mean_y, hits, references, free, free_count)
        cell = (row + 1) * STRIDE + column + 1
        # Incremental mean of the ends in the cell: mu += (x - mu) / n
        n = hits[tile, cell] + 1
        hits[tile, cell] = n
        x -= np.float32(tile_column << SHIFT)
        y -= np.float32(tile_row << SHIFT)
        mx, my = x, y
        if n > 1:
            mx = mean_x[tile, cell] + (x - mean_x[tile, cell]) / np.float32(n)
            my = mean_y[tile, cell] + (y - mean_y[tile, cell]) / np.float32(n)
        mean_x[tile, cell], mean_y[tile, cell] = mx, my
        # A cell at the border of a tile is repeated in the halos of the neighbours
        row_side = -1 if row == 0 else (1 if row == SIDE - 1 else 0)
        column_side = -1 if column == 0 else (1 if column == SIDE - 1 else 0)
        for k in range(1, 4):
            row_offset, column_offset = (k & 1) * row_side, (k >> 1) * column_side
            if (row_offset != 0) != (k & 1) or (column_offset != 0) != (k >> 1):
                continue
            neighbour = _writable(
                table, tile_row + row_offset, tile_column + column_offset,
                mean_x, mean_y, hits, references, free, free_count,
            )  # fmt: skip
            halo = (row + 1 - row_offset * SIDE) * STRIDE + column + 1 - column_offset * SIDE
            mean_x[neighbour, halo] = mx - np.float32(column_offset * SIDE)
            mean_y[neighbour, halo] = my - np.float32(row_offset * SIDE)
            hits[neighbour, halo] = n
    return len(ends)
