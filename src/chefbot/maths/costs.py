"""The costmap and its cost values, which are those of Nav2 and RViz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.cell_grid import CellGrid

FREE = 0
INSCRIBED = 253
"""Inscribed cost: the inscribed circle of a robot centred here touches an obstacle."""
LETHAL = 254
UNKNOWN = 255


@dataclass(frozen=True, eq=False)
class Costmap(CellGrid):
    """A costmap of uint8 cells (height, width).

    Costs: 0 free, 1..252 inflation, 253 inscribed, 254 lethal, 255 unknown.
    """

    cells: NDArray[np.uint8]

    def at(self, x: float, y: float) -> int:
        """Return the cost at the point; UNKNOWN outside the costmap."""
        return self.value(x, y, UNKNOWN)
