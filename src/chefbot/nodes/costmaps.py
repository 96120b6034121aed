"""Between messages and costmaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.layers import LayeredCostmap
from chefbot.maths.costs import LETHAL, UNKNOWN, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header

LASER, CAMERA = "laser", "camera"
"""Names of the sensors' layers."""
_AS_PERCENT = np.concatenate([np.arange(255) * 100 // LETHAL, [-1]]).astype(np.int8)
"""Cost to the percent that nav_msgs/OccupancyGrid holds; UNKNOWN to -1."""
assert _AS_PERCENT[UNKNOWN] == -1


def mark_laser(costs: LayeredCostmap, sensor: SE2, scan: LaserScan) -> None:
    """A laser scan from `sensor` in the costmap's frame."""
    ranges = scan.ranges.astype(np.float64)
    ranges[ranges >= scan.range_max] = np.inf
    costs.mark_and_clear(LASER, sensor, scan.angles.astype(np.float64), ranges)


def mark_obstacles(costs: LayeredCostmap, sensor: SE2, seen: ObstacleScan) -> None:
    """What a depth camera saw, from above its foot `sensor` in the costmap's frame."""
    steps = np.arange(len(seen.ranges), dtype=np.float64)
    angles: NDArray[np.float64] = np.asarray(seen.angle_min + steps * seen.angle_increment, np.float64)
    floor = (seen.clear_from.astype(np.float64), seen.clear_to.astype(np.float64))
    costs.mark_and_clear(CAMERA, sensor, angles, seen.ranges.astype(np.float64), floor)


def costmap_message(header: Header, costs: Costmap) -> OccupancyGrid:
    """As Nav2 publishes costmaps."""
    grid = Grid(_AS_PERCENT[costs.cells], costs.resolution, costs.origin_x, costs.origin_y)
    return OccupancyGrid.of(header, grid)
