"""The marks of one sensor in a costmap, and when each was last confirmed."""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.sources import PERMANENT_SOURCES
from chefbot.costmap.update_window import EMPTY_WINDOW, CellWindow
from chefbot.maths.costs import LETHAL, UNKNOWN

N = TypeVar("N", bound=np.generic)


class SensorMarks(NamedTuple):
    """cells (h, w): LETHAL where the sensor saw an obstacle, FREE where it saw none, else UNKNOWN or a cost that does
    not count. marked_at (h, w): time at which a lethal cell was last marked, s. near_since (h, w): time since which
    the robot has been near a lethal cell, s, 0 while it is not; (0, 0) in a window that is always near."""

    cells: NDArray[np.uint8]
    marked_at: NDArray[np.float64]
    near_since: NDArray[np.float64]

    @classmethod
    def empty(cls, shape: tuple[int, ...], *, always_near: bool) -> SensorMarks:
        """Return marks of a sensor that has seen nothing."""
        near_since = np.zeros((0, 0) if always_near else shape)
        return cls(np.full(shape, UNKNOWN, np.uint8), np.zeros(shape), near_since)

    def shifted(self, rows: int, columns: int, shape: tuple[int, ...]) -> SensorMarks:
        """Return the marks in a grid of `shape` with its cell [0, 0] at [rows, columns]; new cells are UNKNOWN."""
        marked_at = shifted(self.marked_at, rows, columns, shape, 0.0)
        near_since = self.near_since
        if near_since.size:
            near_since = shifted(near_since, rows, columns, shape, 0.0)
        return SensorMarks(shifted(self.cells, rows, columns, shape, UNKNOWN), marked_at, near_since)

    def only(self, where: NDArray[np.bool_]) -> SensorMarks:
        """Return the marks in the cells `where` (h, w), and all cells that were seen free."""
        return self._replace(cells=np.where(where | (self.cells != LETHAL), self.cells, UNKNOWN))

    def remove_older(self, time: float) -> CellWindow:
        """Remove the marks that were last confirmed before `time`, s; return their window."""
        marked = np.flatnonzero(self.cells == LETHAL)
        return self._remove(marked[self.marked_at.reshape(-1)[marked] < time])

    def remove_missed(
        self, row: float, column: float, radius: float, time: float, decay: float
    ) -> CellWindow:
        """Remove the marks that the robot has been near for a time without a confirmation; return their window.

        Near is within `radius` cells of its row and column. time: now, s. decay: that time, s.
        """
        marked = np.flatnonzero(self.cells == LETHAL)
        rows, columns = np.divmod(marked, self.cells.shape[1])
        is_near = np.hypot(rows + 0.5 - row, columns + 0.5 - column) <= radius
        since, near = self.near_since.reshape(-1), marked[is_near]
        since[marked[~is_near]] = 0.0
        since[near] = np.where(since[near] > 0.0, since[near], time)
        confirmed = np.maximum(since[near], self.marked_at.reshape(-1)[near])
        return self._remove(near[time - confirmed > decay])

    def _remove(self, marked: NDArray[np.int64]) -> CellWindow:
        """Make marked cells, given by their flat index, unknown; return their window."""
        if not len(marked):
            return EMPTY_WINDOW
        self.cells.reshape(-1)[marked] = UNKNOWN
        rows, columns = np.divmod(marked, self.cells.shape[1])
        return CellWindow(int(rows.min()), int(columns.min()), int(rows.max()) + 1, int(columns.max()) + 1)


def permanent_marks(sources: dict[str, SensorMarks]) -> dict[str, SensorMarks]:
    """Return the marks of the permanent sources."""
    return {name: marks for name, marks in sources.items() if name in PERMANENT_SOURCES}


def marks_in(sources: dict[str, SensorMarks], where: NDArray[np.bool_]) -> dict[str, SensorMarks]:
    """Return the permanent marks and, in the cells `where` (h, w), all others."""
    return {
        name: marks if name in PERMANENT_SOURCES else marks.only(where) for name, marks in sources.items()
    }


def shifted(array: NDArray[N], rows: int, columns: int, shape: tuple[int, ...], fill: float) -> NDArray[N]:
    """Return the array in a grid of `shape` with its cell [0, 0] at [rows, columns]; new cells are `fill`."""
    # pages of zeros take no memory before they are written
    out = np.full(shape, fill, array.dtype) if fill else np.zeros(shape, array.dtype)
    h, w = array.shape
    top, left = max(rows, 0), max(columns, 0)
    bottom, right = min(rows + h, shape[0]), min(columns + w, shape[1])
    if top < bottom and left < right:
        out[top:bottom, left:right] = array[top - rows : bottom - rows, left - columns : right - columns]
    return out
