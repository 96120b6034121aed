"""Between messages and costmaps."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.maths.costs import LETHAL, UNKNOWN, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.spec import Robot

LASER, CAMERA, UPRIGHT = "laser", "camera", "upright"
"""Names of the layers: what the flat scan sees; what the depth camera sees and the flat scan may miss; what the
camera sees standing in the flat scan's plane, so that the flat scan looks through its place when it has left."""
PLANE_MARGIN, PLANE_TILT = 0.03, 0.0175
"""Metres, and radians of nodding, by which an obstacle must reach above and below the plane to stand in it."""
_AS_PERCENT = np.concatenate([np.arange(255) * 100 // LETHAL, [-1]]).astype(np.int8)
"""Cost to the percent that nav_msgs/OccupancyGrid holds; UNKNOWN to -1."""
assert _AS_PERCENT[UNKNOWN] == -1


def plane_of(robot: Robot) -> float:
    """Metres above the floor of the plane in which the robot's flat scan looks: the lidar's, else the camera's.

    NaN, in which nothing stands, where there is none: a sensor that is mounted tilted looks in no level plane.
    """
    flat = robot.sensors.lidar or robot.sensors.depth_camera
    return flat.mount.z if flat is not None and abs(flat.mount.pitch) <= PLANE_TILT else math.nan


def mark_laser(costs: LayeredCostmap, sensor: SE2, scan: LaserScan) -> None:
    """A flat scan from `sensor` in the costmap's frame; what stood upright in its way has left."""
    ranges = scan.ranges.astype(np.float64)
    ranges[ranges >= scan.range_max] = np.inf
    costs.mark_and_clear(LASER, sensor, scan.angles.astype(np.float64), ranges, also=UPRIGHT)


def mark_obstacles(costs: LayeredCostmap, sensor: SE2, seen: ObstacleScan, plane: float) -> None:
    """What a depth camera saw, from above its foot `sensor` in the costmap's frame.

    plane: metres above the floor at which the robot's flat scan looks, as of `plane_of`.
    """
    steps = np.arange(len(seen.ranges), dtype=np.float64)
    angles: NDArray[np.float64] = np.asarray(seen.angle_min + steps * seen.angle_increment, np.float64)
    floor = (seen.clear_from.astype(np.float64), seen.clear_to.astype(np.float64))
    ranges = seen.ranges.astype(np.float64)
    upright = _in_plane(seen, ranges, plane)
    for layer, one in ((CAMERA, ~upright), (UPRIGHT, upright)):
        costs.mark_and_clear(layer, sensor, angles, np.where(one, ranges, np.inf), floor)


def _in_plane(seen: ObstacleScan, ranges: NDArray[np.float64], plane: float) -> NDArray[np.bool_]:
    """Which obstacles (n,) the flat scan sees too, also while the robot nods."""
    if len(seen.bottom) != len(ranges) or len(seen.top) != len(ranges):
        return np.zeros(len(ranges), np.bool_)  # nobody measured: nothing is known to stand in the plane
    margin = PLANE_MARGIN + PLANE_TILT * np.where(np.isfinite(ranges), ranges, 0.0)
    result: NDArray[np.bool_] = (seen.bottom < plane - margin) & (seen.top > plane + margin)
    return result


def costmap_message(header: Header, costs: Costmap) -> OccupancyGrid:
    """As Nav2 publishes costmaps."""
    grid = Grid(_AS_PERCENT[costs.cells], costs.resolution, costs.origin_x, costs.origin_y)
    return OccupancyGrid.of(header, grid)
