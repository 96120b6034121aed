"""The occupancy grid that mapping makes and localization and navigation use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

UNKNOWN = -1
FREE = 0
OCCUPIED = 100


@dataclass(frozen=True, eq=False)
class Grid:
    """Cells in rows from low y to high y, as in nav_msgs/OccupancyGrid; the axes are those of the map frame.

    cells: (height, width) int8; -1 unknown, 0..100 percent occupied.
    resolution: metres per cell.
    origin_x, origin_y: metres, the outer corner of cell [0, 0] in the map frame.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin_x: float
    origin_y: float

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.cells.shape[0])

    @property
    def width(self) -> int:
        """Columns."""
        return int(self.cells.shape[1])

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """(row, column) of the cell that holds the point; it may lie outside the grid."""
        return (
            int(np.floor((y - self.origin_y) / self.resolution)),
            int(np.floor((x - self.origin_x) / self.resolution)),
        )

    def centre(self, row: int, column: int) -> tuple[float, float]:
        """(x, y) of the middle of a cell, metres."""
        return (
            self.origin_x + (column + 0.5) * self.resolution,
            self.origin_y + (row + 0.5) * self.resolution,
        )

    def contains(self, x: float, y: float) -> bool:
        """Whether the point lies on the grid."""
        row, column = self.cell(x, y)
        return 0 <= row < self.height and 0 <= column < self.width

    def at(self, x: float, y: float) -> int:
        """The value of the cell that holds the point; UNKNOWN outside the grid."""
        row, column = self.cell(x, y)
        if 0 <= row < self.height and 0 <= column < self.width:
            return int(self.cells[row, column])
        return UNKNOWN
