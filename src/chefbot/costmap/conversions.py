"""Conversions between messages and costmaps."""

from __future__ import annotations

import math

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
from chefbot.robot.spec import Robot

LASER, CAMERA, UPRIGHT = "laser", "camera", "upright"
"""Names of the obstacle layers: obstacles in the planar scan; obstacles in the depth camera that the planar scan may
miss; obstacles in the camera that intersect the scan plane, so that the planar scan clears them once they left."""
PLANE_MARGIN, PLANE_TILT = 0.03, 0.0175
"""Margins, m and rad of pitch, by which an obstacle must extend above and below the scan plane."""
_COST_TO_OCCUPANCY = np.concatenate([np.arange(255) * 100 // LETHAL, [-1]]).astype(np.int8)
"""Occupancy in percent, as in nav_msgs/OccupancyGrid, by cost; -1 for UNKNOWN."""


def plane_of(robot: Robot) -> float:
    """Return the height (m) above the floor of the robot's scan plane: the lidar's, else the depth camera's.

    NaN, which no obstacle intersects, if there is none: the scan of a tilted sensor is not in a level plane.
    """
    sensor = robot.sensors.lidar or robot.sensors.depth_camera
    return sensor.mount.z if sensor is not None and abs(sensor.mount.pitch) <= PLANE_TILT else math.nan


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
    upright = _in_plane(scan, ranges, plane)
    for layer, selected in ((CAMERA, ~upright), (UPRIGHT, upright)):
        costs.mark_and_clear(layer, sensor, angles, np.where(selected, ranges, np.inf), floor)


def _in_plane(scan: ObstacleScan, ranges: NDArray[np.float64], plane: float) -> NDArray[np.bool_]:
    """Return which obstacles (n,) intersect the scan plane, also while the robot pitches."""
    if len(scan.bottom) != len(ranges) or len(scan.top) != len(ranges):
        # heights not measured: no obstacle is known to be in the plane
        return np.zeros(len(ranges), np.bool_)
    margin = PLANE_MARGIN + PLANE_TILT * np.where(np.isfinite(ranges), ranges, 0.0)
    in_plane: NDArray[np.bool_] = (scan.bottom < plane - margin) & (scan.top > plane + margin)
    return in_plane


def costmap_message(header: Header, costs: Costmap) -> OccupancyGrid:
    """Convert a costmap to an OccupancyGrid message as Nav2 publishes it."""
    grid = Grid(_COST_TO_OCCUPANCY[costs.cells], costs.resolution, costs.origin_x, costs.origin_y)
    return OccupancyGrid.of(header, grid)
