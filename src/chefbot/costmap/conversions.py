"""Conversions between messages and costmaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.scan_plane import through_plane

LASER, CAMERA, UPRIGHT = "laser", "camera", "upright"
"""Names of the obstacle layers: obstacles in the planar scan; obstacles in the depth camera that the planar scan may
miss; obstacles in the camera that intersect the scan plane, so that the planar scan clears them once they left."""
_COST_TO_OCCUPANCY = np.concatenate([np.arange(255) * 100 // LETHAL, [-1]]).astype(np.int8)
"""Occupancy in percent, as in nav_msgs/OccupancyGrid, by cost; -1 for UNKNOWN."""


def mark_laser(costs: LayeredCostmap, sensor: SE2, scan: LaserScan) -> None:
    """Mark and clear with a planar scan from `sensor` in the costmap's frame; it clears the upright layer, too."""
    ranges = scan.ranges.astype(np.float64)
    ranges[ranges >= scan.range_max] = np.inf
    costs.mark_and_clear(LASER, sensor, scan.angles.astype(np.float64), ranges, also_clear=UPRIGHT)


def mark_obstacles(costs: LayeredCostmap, sensor: SE2, scan: ObstacleScan, plane: float) -> None:
    """Mark and clear with an obstacle scan of a depth camera whose planar pose in the costmap's frame is `sensor`.

    plane: height (m) of the robot's scan plane above the floor, from `plane_of`.
    """
    steps = np.arange(len(scan.ranges), dtype=np.float64)
    angles: NDArray[np.float64] = np.asarray(scan.angle_min + steps * scan.angle_increment, np.float64)
    floor = (scan.clear_from.astype(np.float64), scan.clear_to.astype(np.float64))
    ranges = scan.ranges.astype(np.float64)
    upright = through_plane(scan.bottom, scan.top, ranges, plane)
    for layer, selected in ((CAMERA, ~upright), (UPRIGHT, upright)):
        costs.mark_and_clear(layer, sensor, angles, np.where(selected, ranges, np.inf), floor)


def costmap_message(header: Header, costs: Costmap) -> OccupancyGrid:
    """Convert a costmap to an OccupancyGrid message as Nav2 publishes it."""
    grid = Grid(_COST_TO_OCCUPANCY[costs.cells], costs.resolution, costs.origin_x, costs.origin_y)
    return OccupancyGrid.of(header, grid)
