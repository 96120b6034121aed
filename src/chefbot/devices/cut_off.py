"""Which places the robot can no longer reach after a change of the map or its keep-out zones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.costs import INSCRIBED, LETHAL
from chefbot.maths.grid import OCCUPIED, Grid
from chefbot.maths.polygon import GridGeometry, cells_touched
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, MapZone
from chefbot.planning.route_lengths import RouteLengths
from chefbot.robot.spec import Robot


class Walls(NamedTuple):
    """What closes paths: the map, and its keep-out zones; the other zones make no place unreachable."""

    grid: Grid
    zones: Iterable[MapZone]


def cut_off(robot: Robot, start: SE2, places: Mapping[str, SE2], before: Walls, after: Walls) -> list[str]:
    """Return the places that the planner reaches from `start` as it was before, but not after; in the map frame."""
    could = reachable(before.grid, robot, start, places, before.zones)
    can = reachable(after.grid, robot, start, places, after.zones)
    return [name for name in places if name in could - can]


def reachable(
    grid: Grid, robot: Robot, start: SE2, places: Mapping[str, SE2], zones: Iterable[MapZone]
) -> set[str]:
    """Return the places that the planner reaches from `start` on the map with keep-out zones."""
    costs = LayeredCostmap(CostmapParams(), robot.footprint, avoid_unknown=robot.sensors.forward_sensing_only)
    costs.set_static(_with_keep_out(grid, zones))
    routes = RouteLengths(costs.update())
    return {name for name, pose in places.items() if routes.has_path(start, pose)}


def without_room(walls: Walls, robot: Robot, poses: Mapping[str, SE2]) -> set[str]:
    """Return the poses at which the robot's inscribed circle touches a wall or a keep-out zone of the map."""
    costs = LayeredCostmap(CostmapParams(), robot.footprint)
    costs.set_static(_with_keep_out(walls.grid, walls.zones))
    costmap = costs.update()
    return {name for name, pose in poses.items() if INSCRIBED <= costmap.at(pose.x, pose.y) <= LETHAL}


def _with_keep_out(grid: Grid, zones: Iterable[MapZone]) -> Grid:
    """Return the map with the keep-out zones as walls."""
    cells = np.array(grid.cells)
    geometry = GridGeometry(grid.resolution, grid.origin_x, grid.origin_y, grid.height, grid.width)
    for zone in zones:
        if zone.kind == KEEP_OUT:
            cells[cells_touched(zone.array, geometry)] = OCCUPIED
    return Grid(cells, grid.resolution, grid.origin_x, grid.origin_y)
