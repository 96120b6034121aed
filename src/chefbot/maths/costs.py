"""The costmap and its cost values, which are those of Nav2 and RViz."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.cell_grid import CellGrid
from chefbot.maths.footprint_collision import lethal_on_edges, lethal_while_rotating
from chefbot.maths.lanes import NO_LANES, OneWayLanes
from chefbot.maths.se2 import SE2

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
    footprint: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    """Corners (n, 2) of the robot in base_link, m; empty for a disc, for which the costs of the cells suffice."""
    lanes: OneWayLanes = NO_LANES
    """One-way lanes, which only a planner obeys: a robot that tracks a path may have to back out."""

    def lethal_on_footprint(self, pose: SE2) -> int:
        """Return the number of points on the edges of the footprint at `pose` in lethal cells; 0 for a disc."""
        x, y = (pose.x - self.origin_x) / self.resolution, (pose.y - self.origin_y) / self.resolution
        return int(lethal_on_edges(self.cells, x, y, pose.yaw, self.footprint / self.resolution))

    def lethal_while_rotating(self, pose: SE2, angle: float) -> int:
        """Return the largest `lethal_on_footprint` while the robot rotates in place at `pose` by `angle`, rad."""
        x, y = (pose.x - self.origin_x) / self.resolution, (pose.y - self.origin_y) / self.resolution
        corners = self.footprint / self.resolution
        return int(lethal_while_rotating(self.cells, x, y, pose.yaw, angle, corners))

    def at(self, x: float, y: float) -> int:
        """Return the cost at the point; UNKNOWN outside the costmap."""
        return self.value(x, y, UNKNOWN)
