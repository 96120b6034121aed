"""Walls of the map in the local costmap, where the sensors see none, as of glass."""

from __future__ import annotations

import contextlib

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.unseen_walls import unseen_walls
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.nodes.local_costmap import LocalCostmapNode
from chefbot.runtime.node import In, every
from chefbot.runtime.transform_buffer import TransformError

REACH = 1.0
"""Distance of these walls, and of what confirms them, from the robot, m."""


class LocalMapWallsNode(LocalCostmapNode):
    """Base class of a node whose local costmap has the walls of the map that no sensor sees.

    Only with a lidar: what a depth camera does not see is beside and behind it, where its older marks are more exact
    than the map.
    """

    map: In[OccupancyGrid]

    @every(hz=2)
    def mark_map_walls(self) -> None:
        """Replace the walls near the robot by those where the localization has them now."""
        pose = self._pose()
        if self.robot.sensors.lidar is None or pose is None:
            return
        walls = self._unseen_walls(pose.inverse().apply(self._costs.marked_points()))
        # the robot is where it is, whatever the map shows there
        beside = np.hypot(walls[:, 0], walls[:, 1]) > self._costs.inscribed_radius
        self._costs.set_static_points(pose.apply(walls[beside]))

    def _unseen_walls(self, measured: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the middles (m, 2) of walls near which the sensors have measured no point (n, 2), in base_link."""
        with contextlib.suppress(TransformError):  # without localization there is no map
            if self.map.last is not None:
                return unseen_walls(self.map.last.grid, self.tf.lookup("map", "base_link"), REACH, measured)
        return np.empty((0, 2))
