"""Where on a map a drive begins: global localization with its first scans."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.localization.amcl import Amcl
from chefbot.localization.params import AmclParams
from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import SE2

SETTLED_UPDATES = 5
"""Localized updates in a row after which the place counts as found."""


class StartSearch:
    """A particle filter over the whole map that ends when it has settled on one place."""

    def __init__(self, grid: Grid, sensor: SE2, noise: OdometryNoise) -> None:
        """sensor: pose of the laser in base_link."""
        self._grid = grid
        self._amcl = Amcl(AmclParams(odometry_noise=noise), grid, sensor)
        self._settled = 0
        self.updates = 0
        """Number of scans that were used."""

    def update(
        self, angles: NDArray[np.float32], ranges: NDArray[np.float32], range_max: float, odom: SE2
    ) -> SE2 | None:
        """Process a scan; return the pose of the robot in the map at it once the place is found.

        angles: (n,) rad in the laser frame. ranges: (n,) m. odom: pose of the robot in the odom frame.
        """
        if not len(ranges) or not self._amcl.update(angles, ranges, range_max, odom):
            return None
        self.updates += 1
        is_found = self._amcl.converged and self._is_free(self._amcl.pose)
        self._settled = self._settled + 1 if is_found else 0
        return self._amcl.pose if self._settled == SETTLED_UPDATES else None

    def _is_free(self, pose: SE2) -> bool:
        """Return whether the map shows free floor there: a robot stands in no wall, nor where nothing was mapped."""
        return 0 <= self._grid.at(pose.x, pose.y) < OCCUPIED_THRESHOLD
