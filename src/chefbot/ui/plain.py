"""Messages as plain arrays for the page."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.nav_msgs import Path


class CostImage(NamedTuple):
    """Costs as the page wants them: cells (h, w) uint8, metres per cell, corner in metres."""

    cells: NDArray[np.uint8]
    resolution: float
    origin_x: float
    origin_y: float


def cost_image(grid: Grid) -> CostImage:
    """Costs of -1 (unknown) and 0 to 100 as 255 and 0 to 254."""
    costs = np.where(grid.cells < 0, 255, grid.cells.astype(np.int16) * 254 // 100).astype(np.uint8)
    return CostImage(costs, grid.resolution, grid.origin_x, grid.origin_y)


def path_points(path: Path, frame: SE2) -> NDArray[np.float64]:
    """(n, 2) on the map."""
    points = [(one.pose.position.x, one.pose.position.y) for one in path.poses]
    return frame.apply(np.array(points, np.float64).reshape(-1, 2))
