"""Which places of a map the robot can no longer reach after a change of its keep-out zones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.grid import OCCUPIED, Grid
from chefbot.maths.polygon import GridGeometry, cells_touched
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_places import KEEP_OUT, MapZone
from chefbot.planning.route_lengths import RouteLengths
from chefbot.robot.spec import Robot


def cut_off(
    grid: Grid,
    robot: Robot,
    start: SE2,
    places: Mapping[str, SE2],
    before: Iterable[MapZone],
    after: Iterable[MapZone],
) -> list[str]:
    """Return the places that the planner reaches from `start` with the zones `before`, but not with those `after`.

    grid: the map; poses in its frame. Only keep-out zones count: the others make no place unreachable.
    """
    could = reachable(grid, robot, start, places, before)
    can = reachable(grid, robot, start, places, after)
    return [name for name in places if name in could - can]


def reachable(
    grid: Grid, robot: Robot, start: SE2, places: Mapping[str, SE2], zones: Iterable[MapZone]
) -> set[str]:
    """Return the places that the planner reaches from `start` on the map with keep-out zones."""
    costs = LayeredCostmap(CostmapParams(), robot.footprint, avoid_unknown=robot.sensors.forward_sensing_only)
    costs.set_static(_with_keep_out(grid, zones))
    routes = RouteLengths(costs.update())
    return {name for name, pose in places.items() if routes.has_way(start, pose)}


def _with_keep_out(grid: Grid, zones: Iterable[MapZone]) -> Grid:
    """Return the map with the keep-out zones as walls."""
    cells = np.array(grid.cells)
    geometry = GridGeometry(grid.resolution, grid.origin_x, grid.origin_y, grid.height, grid.width)
    for zone in zones:
        if zone.kind == KEEP_OUT:
            cells[cells_touched(zone.array, geometry)] = OCCUPIED
    return Grid(cells, grid.resolution, grid.origin_x, grid.origin_y)
