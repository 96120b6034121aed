"""Conversions between messages and costmaps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.sources import CAMERA, DROP_OFFS, LASER, UPRIGHT
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.scan_plane import plane_of, through_plane
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from chefbot.costmap.layered_costmap import LayeredCostmap

UNSEEN_MARGIN = 0.15
"""Distance from the robot's front at which a drop-off is marked whose edge the camera has not seen, m."""
MARKED_BEHIND = 0.5
"""Minimum depth of the ground behind the edge of a drop-off that is marked, too, m: a hole is wider than its edge."""
_COST_TO_OCCUPANCY = np.array(
    [0, *(1 + 97 * (cost - 1) // 251 for cost in range(1, INSCRIBED)), 99, 100, -1], np.int8
)
"""Occupancy in percent by cost, as Nav2's Costmap2DPublisher translates it: 1 to 98 for costs below INSCRIBED."""


class ObstacleMarking(NamedTuple):
    """How the obstacle scans of a robot's depth camera are marked.

    plane: height of the robot's scan plane above the floor, m, from `plane_of`. drop_range: distance up to which the
    camera shows every drop-off, and clears them, m. unseen_from: distance from the point below the camera, m, from
    which on the floor before the image is not known to be there.
    """

    plane: float
    drop_range: float
    unseen_from: float

    @staticmethod
    def of(robot: Robot, drop_range: float) -> ObstacleMarking:
        """Return how a robot's obstacle scans are marked."""
        camera = robot.sensors.depth_camera
        ahead = robot.footprint.front - camera.mount.x if camera is not None else 0.0
        return ObstacleMarking(plane_of(robot), drop_range, max(ahead, 0.0) + UNSEEN_MARGIN)


def mark_laser(costs: LayeredCostmap, sensor: SE2, scan: LaserScan) -> None:
    """Mark and clear with a planar scan from `sensor` in the costmap's frame; it clears upright things, too."""
    ranges = scan.ranges.astype(np.float64)
    ranges[ranges >= scan.range_max] = np.inf
    costs.mark_and_clear(LASER, sensor, scan.angles.astype(np.float64), ranges, also_clear=UPRIGHT)


def mark_obstacles(costs: LayeredCostmap, sensor: SE2, scan: ObstacleScan, marking: ObstacleMarking) -> None:
    """Mark and clear with an obstacle scan of a depth camera whose planar pose in the costmap's frame is `sensor`."""
    angles = scan.angles
    floor = (scan.clear_from.astype(np.float64), scan.clear_to.astype(np.float64))
    ranges = scan.ranges.astype(np.float64)
    upright, drops = through_plane(scan.bottom, scan.top, ranges, marking.plane), _drop_offs(scan)
    for source, selected in ((CAMERA, ~upright & ~drops), (UPRIGHT, upright)):
        costs.mark_and_clear(source, sensor, angles, np.where(selected, ranges, np.inf), floor)
    if drops.any() or costs.has_source(DROP_OFFS):
        edges = np.where(drops, ranges, np.inf)
        longest = costs.params.marking_range
        # an edge nearer than the image: marked already, or else unknown
        for i in np.flatnonzero(drops & ~(floor[1] > 0.0)).tolist():
            beam = SE2(sensor.x, sensor.y, sensor.yaw + float(angles[i]))
            known = _is_marked_along(costs, beam, marking.unseen_from, np.clip(ranges[i], 0.0, longest))
            edges[i] = np.inf if known else marking.unseen_from
        limited = floor[0], np.minimum(floor[1], marking.drop_range)
        costs.mark_and_clear(DROP_OFFS, sensor, angles, edges, limited)
        depth = np.clip(scan.lower_ground(longest)[drops] - edges[drops], MARKED_BEHIND, longest)
        _mark_behind(costs, sensor, angles[drops], edges[drops], depth)


def _mark_behind(
    costs: LayeredCostmap,
    sensor: SE2,
    angles: NDArray[np.float64],
    edges: NDArray[np.float64],
    depth: NDArray[np.float64],
) -> None:
    """Mark the ground behind the edges of drop-offs (n,), m, for a depth (n,), m, or up to where it has seen floor.

    Of a hole the camera sees the edge that it looks over; around its ends the robot turns to others, which are too
    near then.
    """
    near = edges <= costs.params.marking_range
    if not near.any():
        return
    behind = np.arange(costs.resolution / 2.0, float(depth[near].max()), costs.resolution / 2.0)
    distance, yaw = edges[near, None] + behind, sensor.yaw + angles[near, None]
    rows = np.floor((sensor.y + distance * np.sin(yaw) - costs.origin_y) / costs.resolution).astype(np.int64)
    columns = np.floor((sensor.x + distance * np.cos(yaw) - costs.origin_x) / costs.resolution).astype(
        np.int64
    )
    cells = costs.source_cells(DROP_OFFS)
    height, width = cells.shape
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    floor = ~inside
    floor[inside] = cells[rows[inside], columns[inside]] == FREE
    chosen = ~np.logical_or.accumulate(floor, axis=1) & (behind < depth[near, None])
    marked = rows[chosen], columns[chosen]
    cells[marked] = LETHAL
    costs.note_marks(DROP_OFFS, marked)
    if chosen.any():
        costs.note_change(sensor, float(distance[chosen].max()))


def _drop_offs(scan: ObstacleScan) -> NDArray[np.bool_]:
    """Return which obstacles (n,) are drop-offs: they are below the floor."""
    if len(scan.bottom) != len(scan.ranges):
        return np.zeros(len(scan.ranges), np.bool_)
    return np.asarray(np.isfinite(scan.ranges) & (scan.bottom < 0.0))


def _is_marked_along(costs: LayeredCostmap, beam: SE2, start: float, end: float) -> bool:
    """Return whether a drop-off is marked on a beam between two distances, m, or in a cell beside it.

    A line of marked cells may be connected at its corners only.
    """
    distances = np.arange(start, end + costs.resolution, costs.resolution / 2.0)
    columns = np.floor((beam.x + distances * math.cos(beam.yaw) - costs.origin_x) / costs.resolution)
    rows = np.floor((beam.y + distances * math.sin(beam.yaw) - costs.origin_y) / costs.resolution)
    cells = costs.source_cells(DROP_OFFS)
    h, w = cells.shape
    inside = (rows >= 1) & (rows < h - 1) & (columns >= 1) & (columns < w - 1)
    r, c = rows[inside].astype(np.int64), columns[inside].astype(np.int64)
    return any((cells[r + i, c + j] == LETHAL).any() for i in (-1, 0, 1) for j in (-1, 0, 1))


def costmap_message(header: Header, costs: Costmap) -> OccupancyGrid:
    """Convert a costmap to an OccupancyGrid message as Nav2 publishes it."""
    grid = Grid(_COST_TO_OCCUPANCY[costs.cells], costs.resolution, costs.origin_x, costs.origin_y)
    return OccupancyGrid.of(header, grid)
