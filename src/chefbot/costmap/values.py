"""What a cell costs, in the numbers that Nav2 and RViz use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FREE = 0
INSCRIBED = 253
"""The disk-shaped robot touches something when its centre is here."""
LETHAL = 254
UNKNOWN = 255


@dataclass(frozen=True, eq=False)
class Costmap:
    """Cells in rows from low y to high y; the axes are those of the frame that the owner names.

    cells: (height, width) uint8; 0 free, 1..252 near something, 253 inscribed, 254 lethal, 255 unknown.
    resolution: metres per cell.
    origin_x, origin_y: metres, the outer corner of cell [0, 0].
    """

    cells: NDArray[np.uint8]
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
        """(row, column) of the cell that holds the point; it may lie outside."""
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
        """Whether the point lies on the map."""
        row, column = self.cell(x, y)
        return 0 <= row < self.height and 0 <= column < self.width

    def at(self, x: float, y: float) -> int:
        """The cost at the point; UNKNOWN outside."""
        row, column = self.cell(x, y)
        if 0 <= row < self.height and 0 <= column < self.width:
            return int(self.cells[row, column])
        return UNKNOWN
