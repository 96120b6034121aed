"""The maps of all particles: tiles of cells shared between particles until one of them writes.

A map cell keeps how many beams ended in it and the mean of those ends (Grisetti et al. 2007 keep the same in
gmapping): the mean places a surface to a fraction of a cell. Cells never hit are all alike, so a map is a
table of tiles in which most entries are tile 0, the empty one. When particles are resampled only the small
tables are copied; a tile is copied when a particle writes to a tile that others read too.

Each tile repeats the outermost cells of its neighbours, so that the 3 x 3 cells around any of its own cells
lie in one tile and the scan matcher reads one table entry for a beam.

Lengths are in cells here, relative to the table's corner, or to the corner of a tile for the means.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.slam.cell_bounds import NOTHING, cells_of

SHIFT = 4
SIDE = 1 << SHIFT
"""Cells along a tile."""
STRIDE = SIDE + 2
AREA = STRIDE * STRIDE
FAR = np.float32(1e6)
"""Coordinate of the mean of a cell without hits: further than any beam's reach."""
EMPTY = 0
_MARGIN = 16
"""Tiles added around a table that must grow, so that it seldom does."""

_T = TypeVar("_T", bound=np.generic)


class TileMaps:
    """One map for each of `particles` particles; `max_cells` bounds the rectangle they cover."""

    def __init__(self, particles: int, max_cells: int) -> None:
        self.table: NDArray[np.int32] = np.zeros((particles, 0, 0), np.int32)
        self._extent = NOTHING
        """Of the tables, in tiles."""
        self._max_cells = max_cells
        self.mean_x: NDArray[np.float32] = np.full((256, AREA), FAR, np.float32)
        self.mean_y: NDArray[np.float32] = np.full((256, AREA), FAR, np.float32)
        self.hits: NDArray[np.int32] = np.zeros((256, AREA), np.int32)
        self._references: NDArray[np.int32] = np.zeros(256, np.int32)
        self._free = np.arange(255, 0, -1, dtype=np.int32)
        self._free_count = np.array([255])

    @property
    def tiles_in_use(self) -> int:
        """Tiles that hold cells, each counted once however many particles share it."""
        return len(self._references) - 1 - int(self._free_count[0])

    @property
    def corner(self) -> NDArray[np.int64]:
        """(x, y) of the tables' corner in cells of the map frame."""
        return self._extent.begin * SIDE

    def cover(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Let the tables reach from `low` to `high`, (x, y) in cells of the map frame, and a tile further.

        UserError if that takes more than `max_cells`.
        """
        first, last = cells_of(np.vstack([low, high])) // SIDE + np.array([[-1], [1]])
        if self._extent.holds(first, last):
            return
        extent = self._extent.grown(first, last, np.full(2, _MARGIN))
        extent.times(SIDE).limited(self._max_cells)
        self.table = self._extent.moved(self.table, extent)
        self._extent = extent

    def add(self, particle: int, ends: NDArray[np.float32]) -> None:
        """Mark the ends of beams, (n, 2) in cells relative to the table's corner; `cover` comes before."""
        done = 0
        while done < len(ends):
            done = _add(
                ends, done, self.table[particle], self.mean_x, self.mean_y, self.hits,
                self._references, self._free, self._free_count,
            )  # fmt: skip
            if done < len(ends):
                self._more_tiles()

    def _more_tiles(self) -> None:
        old = len(self._references)
        new = old + old // 2
        self.mean_x = _lengthened(self.mean_x, new)
        self.mean_y = _lengthened(self.mean_y, new)
        self.hits = _lengthened(self.hits, new)
        self._references = _lengthened(self._references, new)
        free = np.empty(new, np.int32)
        held = int(self._free_count[0])
        free[: new - old] = np.arange(new - 1, old - 1, -1)
        free[new - old : new - old + held] = self._free[:held]
        self._free = free
        self._free_count[0] = held + new - old

    def resample(self, parents: NDArray[np.int64]) -> None:
        """Particle i goes on with the map of particle `parents[i]`."""
        self.table = np.ascontiguousarray(self.table[parents])
        _count(self.table, self._references, self._free, self._free_count)


def _lengthened(array: NDArray[_T], length: int) -> NDArray[_T]:
    longer = np.empty((length, *array.shape[1:]), array.dtype)
    longer[: len(array)] = array
    return longer


@njit(cache=True, nogil=True)
def _count(tables, references, free, free_count):  # type: ignore[no-untyped-def]
    """Count anew how many maps use each tile, and list the tiles that none does."""
    references[:] = 0
    for tile in tables.flat:
        references[tile] += 1
    n = 0
    for tile in range(len(references) - 1, EMPTY, -1):
        if references[tile] == 0:
            free[n] = tile
            n += 1
    free_count[0] = n


@njit(cache=True, nogil=True)
def _writable(table, row, column, mean_x, mean_y, hits, references, free, free_count):  # type: ignore[no-untyped-def]
    """The tile at (row, column), first copied if it is shared."""
    tile = table[row, column]
    if tile != EMPTY and references[tile] == 1:
        return tile
    free_count[0] -= 1
    own = free[free_count[0]]
    for cell in range(AREA):
        mean_x[own, cell], mean_y[own, cell] = mean_x[tile, cell], mean_y[tile, cell]
        hits[own, cell] = hits[tile, cell]
    if tile != EMPTY:
        references[tile] -= 1
    references[own] = 1
    table[row, column] = own
    return own


@njit(cache=True, nogil=True)
def _add(ends, begin, table, mean_x, mean_y, hits, references, free, free_count):  # type: ignore[no-untyped-def]
    """Mark ends[begin:]; returns how far it came before tiles ran short."""
    for i in range(begin, len(ends)):
        if free_count[0] < 4:
            return i
        x, y = ends[i, 0], ends[i, 1]
        column, row = int(np.floor(x)), int(np.floor(y))
        tile_row, tile_column = row >> SHIFT, column >> SHIFT
        row -= tile_row << SHIFT
        column -= tile_column << SHIFT
        tile = _writable(table, tile_row, tile_column, mean_x, mean_y, hits, references, free, free_count)
        cell = (row + 1) * STRIDE + column + 1
        n = hits[tile, cell] + 1
        hits[tile, cell] = n
        x -= np.float32(tile_column << SHIFT)
        y -= np.float32(tile_row << SHIFT)
        mx, my = x, y
        if n > 1:
            mx = mean_x[tile, cell] + (x - mean_x[tile, cell]) / np.float32(n)
            my = mean_y[tile, cell] + (y - mean_y[tile, cell]) / np.float32(n)
        mean_x[tile, cell], mean_y[tile, cell] = mx, my
        down = -1 if row == 0 else (1 if row == SIDE - 1 else 0)
        across = -1 if column == 0 else (1 if column == SIDE - 1 else 0)
        for k in range(1, 4):
            by_row, by_column = (k & 1) * down, (k >> 1) * across
            if (by_row != 0) != (k & 1) or (by_column != 0) != (k >> 1):
                continue
            other = _writable(
                table, tile_row + by_row, tile_column + by_column,
                mean_x, mean_y, hits, references, free, free_count,
            )  # fmt: skip
            halo = (row + 1 - by_row * SIDE) * STRIDE + column + 1 - by_column * SIDE
            mean_x[other, halo] = mx - np.float32(by_column * SIDE)
            mean_y[other, halo] = my - np.float32(by_row * SIDE)
            hits[other, halo] = n
    return len(ends)
