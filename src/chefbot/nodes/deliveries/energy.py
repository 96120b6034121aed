"""What a delivery round knows of its routes: their lengths on the map, and the nearest place to park."""

from __future__ import annotations

import math
from itertools import pairwise

from chefbot.costmap.params import CostmapParams
from chefbot.delivery.energy_forecast import EnergyForecast, Stop
from chefbot.delivery.params import DeliveryParams
from chefbot.errors import UserError
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import BatteryStatus, MapZones, Places
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.navigation.costmap_layers import make_costmap
from chefbot.place_names import display_name
from chefbot.planning.parking import ParkingSearch
from chefbot.planning.route_lengths import RouteLengths
from chefbot.runtime.node import In, Node
from chefbot.runtime.transform_buffer import TransformError
from chefbot.storage.places import find_place


class DeliveryEnergyNode(Node):
    """Base class of a node that compares routes with the energy of the battery."""

    # not `trays`: which food is on board depends on it
    live_params = ("kitchen", "home", "loading_timeout", "pickup_timeout", "stop_time")
    params: DeliveryParams
    map: In[OccupancyGrid]
    places: In[Places]
    zones: In[MapZones]
    battery_status: In[BatteryStatus]

    def start(self) -> None:
        """Start without lengths of routes, until the first map."""
        self._routes: RouteLengths | None = None
        self._parking: ParkingSearch | None = None
        self._forecast = EnergyForecast(self._length, self.params.stop_time)

    def on_map(self, _: OccupancyGrid) -> None:
        """Measure the routes again on the next request."""
        self._routes = self._parking = None

    def on_zones(self, _: MapZones) -> None:
        """Measure the routes again on the next request: keep-out zones and one-way lanes close some."""
        self._routes = None

    def on_places(self, _: Places) -> None:
        """Look for parking places away from the new places."""
        self._parking = None

    def _length(self, stops: tuple[Stop, ...]) -> float:
        """Return an upper bound of the route from the robot over the stops, m; NaN without a map or a pose."""
        lengths, route = self._route_lengths(), self._route(stops)
        return sum(lengths.between(a, b) for a, b in pairwise(route)) if lengths and route else math.nan

    def _route(self, stops: tuple[Stop, ...]) -> tuple[SE2, ...]:
        """Return the poses of the robot and of the stops; empty if one of them is not known."""
        robot, poses = self._robot_pose(), self._poses()
        known = [stop if isinstance(stop, PoseStamped) else poses.get(stop) for stop in stops]
        if robot is None or None in known:
            return ()
        return (robot, *(pose.pose.se2 for pose in known if pose is not None))

    def _map_has_path(self, place: PoseStamped) -> bool:
        """Return whether the map shows a path from the robot to a place, or True without a map or a pose."""
        routes, robot = self._route_lengths(), self._robot_pose()
        return routes is None or robot is None or routes.has_path_to(place.pose.se2, robot)

    def _parking_place(self) -> tuple[PoseStamped, float] | None:
        """Return the nearest place to park and the length of the path to it, m."""
        routes, robot = self._route_lengths(), self._robot_pose()
        if routes is None or robot is None or self.map.last is None:
            return None
        if self._parking is None:
            served = tuple(p.pose.se2 for name, p in self._poses().items() if name != self.params.home)
            self._parking = ParkingSearch(self.map.last.grid, self.robot.circumscribed_radius, served)
        lengths = routes.table(robot)
        routes.forget(robot)
        place = self._parking.nearest(lengths) if lengths is not None else None
        if place is None:
            return None
        return PoseStamped(Header.of(self.now_ns, "map"), Pose.of(place.pose)), place.length

    def _poses(self) -> dict[str, PoseStamped]:
        return {place.name: place.pose for place in self.places.last.places} if self.places.last else {}

    def _labels(self) -> dict[str, str]:
        return {place.name: place.label for place in self.places.last.places} if self.places.last else {}

    def _resolve(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Return the names of places as on the map; UserError if one of them, kitchen or home is missing, or for food
        to the kitchen."""
        places = self._poses()
        for place in (self.params.kitchen, self.params.home):
            find_place(place, places)
        found = tuple(find_place(name, places, self._labels()) for name in names)
        if self.params.kitchen in found:
            raise UserError(
                f"the food comes from {display_name(self.params.kitchen)}; order it to another place"
            )
        return found

    def _route_lengths(self) -> RouteLengths | None:
        if self._routes is None and self.map.last is not None:
            costs = make_costmap(CostmapParams(), self.robot, rolling=False)
            costs.set_static(self.map.last.grid)
            if self.zones.last is not None:
                costs.process(self.zones.last, IDENTITY)
            self._routes = RouteLengths(costs.update())
        return self._routes

    def _robot_pose(self) -> SE2 | None:
        try:
            return self.tf.lookup("map", "base_link")
        except TransformError:
            return None
