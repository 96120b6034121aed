"""The occupancy grid that mapping produces and localization and navigation use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.cell_grid import CellGrid

UNKNOWN = -1
FREE = 0
OCCUPIED = 100
OCCUPIED_THRESHOLD = 65
"""Occupancy from which a cell counts as occupied, percent, as in Nav2's map server."""


@dataclass(frozen=True, eq=False)
class Grid(CellGrid):
    """An occupancy grid in the map frame: cells (height, width) int8; -1 unknown, 0..100 percent occupied."""

    cells: NDArray[np.int8]

    def at(self, x: float, y: float) -> int:
        """Return the value of the cell that contains the point; UNKNOWN outside the grid."""
        return self.value(x, y, UNKNOWN)
