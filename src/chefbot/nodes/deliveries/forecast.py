"""Publishes when a delivery round reaches its stops, and puts its tables into the shortest order on request."""

from __future__ import annotations

import math

import numpy as np

from chefbot.delivery import status_messages
from chefbot.delivery.round_forecast import DriveTimes, Pace, StopTimes, forecast_stops
from chefbot.delivery.round_outcome import OrderError
from chefbot.delivery.shortest_order import MAX_STOPS, shortest_order
from chefbot.design.sizing.energy_budget import usable_energy
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import DeliveryStatus, MapZones, RoundForecast
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header, String
from chefbot.nodes.battery_monitor import prior_consumption
from chefbot.nodes.deliveries.round import DeliveryRoundNode
from chefbot.planning.route_lengths import RouteLengths
from chefbot.runtime.node import Out, every, topic


class DeliveryForecastNode(DeliveryRoundNode):
    """Base class of the delivery node: looks ahead along its round."""

    round_forecast: Out[RoundForecast] = topic(latched=True)

    def start(self) -> None:
        """Start without a forecast, with the pace of the robot's sizing."""
        super().start()
        self._stop_times = StopTimes(self.params)
        self._drive_times = DriveTimes(prior_consumption(self.robot).seconds_per_metre)
        self._full_energy = usable_energy(self.robot).value
        self._reported = DeliveryStatus()
        self._has_forecast = False
        self._lengths: dict[tuple[SE2, SE2], float] = {}

    def on_map(self, message: OccupancyGrid) -> None:
        """Plan the paths again on the next request."""
        super().on_map(message)
        self._lengths.clear()

    def on_zones(self, message: MapZones) -> None:
        """Plan the paths again on the next request."""
        super().on_zones(message)
        self._lengths.clear()

    def _report_status(self, status: DeliveryStatus) -> None:
        before, self._reported = self._reported, status
        now = self.now_ns / 1e9
        self._stop_times.update(status, now)
        drives, drove = _drive_of(status), _drive_of(before)
        if drives != drove:
            self._drive_times.end(now, arrived=not status.hold_reason and not drives)
            lengths = self._leg_lengths((drives,)) if drives else []
            self._drive_times.begin(lengths[0] if lengths else math.inf, now)

    @every(hz=1)
    def publish_forecast(self) -> None:
        """Publish the forecast of a round, and an empty one after its end."""
        forecast = self._make_forecast()
        if forecast.stops or self._has_forecast:
            self.round_forecast.publish(forecast)
        self._has_forecast = bool(forecast.stops)

    def _make_forecast(self) -> RoundForecast:
        status, header, now = self._round.status, Header.of(self.now_ns, "map"), self.now_ns / 1e9
        stops = self._round.stops_left() if self._round.in_progress else ()
        legs = self._leg_lengths(stops)
        if not legs:
            return RoundForecast(header, status.order_id)
        times = self._stop_times
        times.params = self.params
        stays = [times.expected(at_kitchen=stop == self.params.kitchen) for stop in stops]
        return RoundForecast(
            header, status.order_id, forecast_stops(stops, legs, times.rest(now), stays, self._pace)
        )

    def _leg_lengths(self, stops: tuple[str, ...]) -> list[float]:
        """Return the length of the path to each stop from the reachable one before, m; inf where there is none.

        The list is empty without a map or a pose.
        """
        route, routes = self._route(stops), self._route_lengths()
        if not stops or not route or routes is None:
            return []
        robot, *poses = route
        legs, start = [], robot
        for pose in poses:
            leg = routes.path_length(robot, pose) if start is robot else self._leg_length(routes, start, pose)
            legs.append(leg)
            start = start if math.isinf(leg) else pose
        return legs

    def _leg_length(self, routes: RouteLengths, start: SE2, end: SE2) -> float:
        """Return the length of the path between two places, which is planned once for each map."""
        if (start, end) not in self._lengths:
            self._lengths[start, end] = routes.path_length(start, end)
        return self._lengths[start, end]

    def _warn_of_cut_off(self, names: tuple[str, ...]) -> None:
        """Publish a notice if the map shows no path from the kitchen to some places of a new order."""
        routes, poses = self._route_lengths(), self._poses()
        kitchen = poses.get(self.params.kitchen)
        try:
            places = self._resolve(names)
        except UserError:
            return  # reported when the order begins
        if routes is None or kitchen is None:
            return
        start = kitchen.pose.se2
        lost = [place for place in places if not routes.has_path_to(poses[place].pose.se2, start)]
        if lost:
            self.notice.publish(String(status_messages.NO_PATH.format(status_messages.join_names(lost))))

    @property
    def _pace(self) -> Pace:
        return Pace(self._drive_times.seconds_per_metre, self._forecast.battery, self._full_energy)

    def _shorten_route(self, order_id: str) -> None:
        """Put the tables of the queue into the shortest order; OrderError where that is not possible."""
        status, poses, routes = self._round.status, self._poses(), self._route_lengths()
        queue = status.queue
        if len(queue) > MAX_STOPS:
            raise OrderError(status_messages.TOO_MANY_TO_SORT.format(MAX_STOPS))
        places = (status.place, *queue, self.params.home)
        if routes is None or not queue or not poses.keys() >= {*places}:
            raise OrderError(status_messages.ROUTES_NOT_KNOWN)
        start, *tables, home = (poses[place].pose.se2 for place in places)
        first = np.array([routes.between(start, table) for table in tables])
        between = np.array([[routes.between(a, b) for b in tables] for a in tables])
        last = np.array([routes.between(table, home) for table in tables])
        order = shortest_order(first, between, last)
        self._round.change_queue(order_id, [queue[i] for i in order])


def _drive_of(status: DeliveryStatus) -> str:
    """Return the place that the round drives to, empty while it does not."""
    return status.place if status.state in ("driving", "returning") and not status.hold_reason else ""
