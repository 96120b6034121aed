"""Cells in which the robot's footprint would overlap unknown space."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.inflation import inflate
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, UNKNOWN


def cells_near_unknown(cells: NDArray[np.uint8], radius: float) -> NDArray[np.bool_]:
    """Return the known cells (h, w) within `radius` cells of a large unknown region.

    A region smaller than the disk of that radius is ignored as a gap between beams: no furniture fits into it.
    """
    from scipy import ndimage  # imported late: most robots do not need it

    # connected components of unknown space that are larger than the disk
    regions, _ = ndimage.label(cells == UNKNOWN, structure=np.ones((3, 3)))
    is_large = np.bincount(regions.reshape(-1)) >= math.pi * radius**2
    is_large[0] = False  # label 0 is the known space
    # dilate them by the radius
    table = np.full(math.floor(radius**2 + 1e-9) + 1, INSCRIBED, np.uint8)
    inflated = inflate(np.where(is_large[regions], LETHAL, FREE).astype(np.uint8), table)
    near_unknown: NDArray[np.bool_] = (inflated >= INSCRIBED) & (cells != UNKNOWN)
    return near_unknown
