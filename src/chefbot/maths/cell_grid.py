"""A grid of square cells, the common base of maps and costmaps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class CellGrid:
    """A grid of square cells in a frame, rows from low y to high y as in nav_msgs/OccupancyGrid.

    cells: (height, width). resolution: metres per cell. origin_x, origin_y: metres, the outer corner of cell
    [0, 0] in the frame.
    """

    cells: NDArray[Any]
    resolution: float
    origin_x: float
    origin_y: float

    @property
    def height(self) -> int:
        """Number of rows of cells."""
        return int(self.cells.shape[0])

    @property
    def width(self) -> int:
        """Number of columns of cells."""
        return int(self.cells.shape[1])

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return (row, column) of the cell that contains the point; it may lie outside the grid."""
        return (
            int(np.floor((y - self.origin_y) / self.resolution)),
            int(np.floor((x - self.origin_x) / self.resolution)),
        )

    def centre(self, row: int, column: int) -> tuple[float, float]:
        """Return the centre (x, y) of a cell, metres."""
        return (
            self.origin_x + (column + 0.5) * self.resolution,
            self.origin_y + (row + 0.5) * self.resolution,
        )

    def contains(self, x: float, y: float) -> bool:
        """Return whether the point lies on the grid."""
        row, column = self.cell(x, y)
        return 0 <= row < self.height and 0 <= column < self.width

    def value(self, x: float, y: float, outside: int) -> int:
        """Return the value of the cell that contains the point, or `outside`."""
        row, column = self.cell(x, y)
        return int(self.cells[row, column]) if self.contains(x, y) else outside

    def values(self, x: NDArray[np.float64], y: NDArray[np.float64], outside: int) -> NDArray[Any]:
        """Return the values at the points, shaped like `x` and `y`; `outside` for points off the grid."""
        rows = np.floor((y - self.origin_y) / self.resolution).astype(np.int64)
        columns = np.floor((x - self.origin_x) / self.resolution).astype(np.int64)
        inside = (rows >= 0) & (rows < self.height) & (columns >= 0) & (columns < self.width)
        values: NDArray[Any] = np.where(inside, self.cells[rows * inside, columns * inside], outside)
        return values
