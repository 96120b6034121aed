"""What a cell costs, in the numbers that Nav2 and RViz use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.cell_grid import Raster

FREE = 0
INSCRIBED = 253
"""The disk-shaped robot touches something when its centre is here."""
LETHAL = 254
UNKNOWN = 255


@dataclass(frozen=True, eq=False)
class Costmap(Raster):
    """Prices: cells (height, width) uint8; 0 free, 1..252 near something, 253 inscribed, 254 lethal, 255 unknown."""

    cells: NDArray[np.uint8]

    def at(self, x: float, y: float) -> int:
        """The cost at the point; UNKNOWN outside."""
        return self.value(x, y, UNKNOWN)
