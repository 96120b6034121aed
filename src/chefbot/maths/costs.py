"""The costmap and its cost values, which are those of Nav2 and RViz."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.cell_grid import CellGrid
from chefbot.maths.footprint_collision import comes_nearer, lethal_on_edges
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

    def comes_nearer(self, poses: Sequence[SE2]) -> bool:
        """Return whether the robot touches an obstacle at a pose and is nearer to it than at the first one.

        A disc does not: the costs of the cells suffice for it.
        """
        in_cells = np.array(poses) - np.array([self.origin_x, self.origin_y, 0.0])
        in_cells[:, :2] /= self.resolution
        return bool(comes_nearer(self.cells, in_cells, self.footprint / self.resolution))

    def comes_nearer_by_rotating(self, pose: SE2, angle: float) -> bool:
        """Return whether the robot comes nearer to an obstacle that it touches while it rotates in place.

        angle: rad; more than one turn sweeps no more than one.
        """
        if not len(self.footprint):
            return False
        angle = math.copysign(min(abs(angle), math.tau), angle)
        arm = float(np.hypot(self.footprint[:, 0], self.footprint[:, 1]).max())
        steps = max(1, math.ceil(abs(angle) * arm / (self.resolution / 2.0)))
        return self.comes_nearer(
            [SE2(pose.x, pose.y, pose.yaw + angle * k / steps) for k in range(steps + 1)]
        )

    def at(self, x: float, y: float) -> int:
        """Return the cost at the point; UNKNOWN outside the costmap."""
        return self.value(x, y, UNKNOWN)
