"""A rectangular window of cells in which a costmap has changed."""

from __future__ import annotations

import math
from typing import NamedTuple


class CellWindow(NamedTuple):
    """A window of grid cells: rows top to bottom and columns left to right, the last ones excluded."""

    top: int
    left: int
    bottom: int
    right: int

    @staticmethod
    def around(row: float, column: float, radius: float) -> CellWindow:
        """Return the window of all cells that a disk touches; row, column and radius in fractional cells.

        One more cell on each side allows for rounding.
        """
        low_row, low_column = math.floor(row - radius) - 1, math.floor(column - radius) - 1
        return CellWindow(low_row, low_column, math.floor(row + radius) + 2, math.floor(column + radius) + 2)

    @property
    def empty(self) -> bool:
        """Whether the window contains no cell."""
        return self.top >= self.bottom or self.left >= self.right

    @property
    def slices(self) -> tuple[slice, slice]:
        """Row and column slices that index an array."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def union(self, other: CellWindow) -> CellWindow:
        """Return the smallest window that contains both."""
        if self.empty or other.empty:
            return other if self.empty else self
        return CellWindow(
            min(self.top, other.top),
            min(self.left, other.left),
            max(self.bottom, other.bottom),
            max(self.right, other.right),
        )

    def expanded(self, cells: int, shape: tuple[int, ...]) -> CellWindow:
        """Return the window expanded by `cells` on every side and clipped to a grid of that shape."""
        return CellWindow(
            max(self.top - cells, 0),
            max(self.left - cells, 0),
            min(self.bottom + cells, shape[0]),
            min(self.right + cells, shape[1]),
        )

    def relative_to(self, other: CellWindow) -> CellWindow:
        """Return the same cells relative to the corner of `other`."""
        return CellWindow(
            self.top - other.top, self.left - other.left, self.bottom - other.top, self.right - other.left
        )


EMPTY_WINDOW = CellWindow(0, 0, 0, 0)
