"""Which places the robot can no longer reach, or not come back from, after a change of the map or its zones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.costs import INSCRIBED, LETHAL
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs.maps import MapZone, MapZones
from chefbot.nodes.navigation.costmap_layers import make_costmap
from chefbot.planning.route_lengths import RouteLengths
from chefbot.robot.spec import Robot


class Walls(NamedTuple):
    """What closes paths: the map and its keep-out zones, and its one-way lanes in one direction."""

    grid: Grid
    zones: tuple[MapZone, ...]


class Reach(NamedTuple):
    """Names of the places to which there is a path from the robot, and of those from which there is one to it."""

    there: set[str]
    back: set[str]


class CutOff(NamedTuple):
    """Names of the places that are no longer reached, and of those that are, but without a path back."""

    no_path: list[str]
    no_path_back: list[str]


def cut_off(robot: Robot, start: SE2, places: Mapping[str, SE2], before: Walls, after: Walls) -> CutOff:
    """Return the places that a change of the map cuts off from `start`; in the map frame."""
    could, can = reach(before, robot, start, places), reach(after, robot, start, places)
    no_path = could.there - can.there
    no_path_back = (could.back - can.back) & can.there
    return CutOff(*([name for name in places if name in lost] for lost in (no_path, no_path_back)))


def reach(walls: Walls, robot: Robot, start: SE2, places: Mapping[str, SE2]) -> Reach:
    """Return the places that the planner reaches from `start`, and those from which it reaches `start`."""
    costs = make_costmap(CostmapParams(), robot, rolling=False)
    costs.set_static(walls.grid)
    costs.process(MapZones(zones=walls.zones), IDENTITY)
    routes = RouteLengths(costs.update())
    return Reach(
        {name for name, pose in places.items() if routes.has_path(start, pose)},
        {name for name, pose in places.items() if routes.has_path_to(start, pose)},
    )


def without_room(grid: Grid, robot: Robot, poses: Mapping[str, SE2]) -> set[str]:
    """Return the poses at which the robot's inscribed circle touches a wall of the map."""
    costs = LayeredCostmap(CostmapParams(), robot.footprint)
    costs.set_static(grid)
    costmap = costs.update()
    return {name for name, pose in poses.items() if INSCRIBED <= costmap.at(pose.x, pose.y) <= LETHAL}
