"""Where the robot's body would reach into what nothing has seen."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.inflation import inflate
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, UNKNOWN


def beside_unseen(cells: NDArray[np.uint8], radius: float) -> NDArray[np.bool_]:
    """Known cells (h, w) within `radius` cells of an unseen region.

    A region smaller than the disk of that radius is a gap between the beams: no furniture hides in it.
    """
    from scipy import ndimage  # takes half a second, and the first picture does not need it

    regions, _ = ndimage.label(cells == UNKNOWN, structure=np.ones((3, 3)))
    large = np.bincount(regions.reshape(-1)) >= math.pi * radius**2
    large[0] = False  # all that is known
    table = np.full(math.floor(radius**2 + 1e-9) + 1, INSCRIBED, np.uint8)
    near = inflate(np.where(large[regions], LETHAL, FREE).astype(np.uint8), table)
    result: NDArray[np.bool_] = (near >= INSCRIBED) & (cells != UNKNOWN)
    return result
