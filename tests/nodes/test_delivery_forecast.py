"""The delivery node publishes when its round reaches its stops, and sorts its tables on request."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest
from tests.nodes.test_delivery import DeliveryRunner
from tests.planning.rooms import RESOLUTION, WALL, walled

from chefbot.delivery.status_messages import QUEUE_CHANGED, ROUTES_NOT_KNOWN
from chefbot.errors import UserError
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import BatteryStatus, MapZone, MapZones, Order, Place, Places, RoundForecast
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Empty, Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.deliveries.forecast import DeliveryForecastNode

PLACES = {
    "kitchen": SE2(1.0, 2.0, 0.0),
    "home": SE2(1.5, 1.0, 0.0),
    **{f"table_{x}": SE2(float(x), 2.0, 0.0) for x in range(2, 20)},
}
PLAIN = Header.of(0, "map")


class Restaurant(DeliveryRunner):
    """A hall of 20 m with tables along it, and a robot where a test puts it."""

    def __init__(self, **delivery: float) -> None:
        super().__init__(**delivery)
        self.publish("map", OccupancyGrid.of(PLAIN, walled(20.0, 4.0)))
        stamped = {name: PoseStamped(PLAIN, Pose.of(pose)) for name, pose in PLACES.items()}
        self.publish("places", Places(tuple(Place(name, pose) for name, pose in stamped.items())))
        self.put("home")

    def put(self, place: str) -> None:
        for parent, child, at in (("map", "odom", PLACES[place]), ("odom", "base_link", IDENTITY)):
            stamped = TransformStamped.of(self.loop.now_ns, parent, child, at)
            self.publish("tf", TFMessage((stamped,)))

    def order(self, *tables: str) -> Restaurant:
        self.publish("order", Order(tables, "a"))
        return self

    @property
    def stops(self) -> list[str]:
        return [stop.place for stop in self.forecast.stops]

    @property
    def forecast(self) -> RoundForecast:
        """The next one."""
        self.run(1.1)
        latest: RoundForecast = self.messages("round_forecast")[-1]
        return latest

    def notices(self) -> list[Any]:
        return [notice.data for notice in self.messages("delivery/notice")]


def test_the_forecast_has_the_route_over_all_stops() -> None:
    restaurant = Restaurant(stop_time=50.0).order("table_5", "table_9")
    restaurant.until("loading", "kitchen")
    restaurant.put("kitchen")
    forecast = restaurant.forecast
    assert [stop.place for stop in forecast.stops] == ["table_5", "table_9", "home"]
    assert forecast.order_id == "a" and forecast.header.frame_id == "map"
    distances = [stop.distance for stop in forecast.stops]
    assert distances == pytest.approx([4.0, 8.0, 8.0 + math.hypot(7.5, 1.0)], abs=0.2)
    pace = (forecast.stops[1].time - forecast.stops[0].time - 50.0) / (distances[1] - distances[0])
    assert 1.0 < pace < 10.0, "50 s at the table, and some seconds a metre"
    assert all(stop.charge == -1.0 for stop in forecast.stops)


def test_the_forecast_gets_shorter_and_ends_with_the_round() -> None:
    restaurant = Restaurant().order("table_5", "table_9")
    assert restaurant.stops[:1] == ["kitchen"] or restaurant.stops[:1] == ["table_5"]
    restaurant.until("waiting", "table_5")
    assert restaurant.stops == ["table_9", "home"]
    restaurant.until("idle", "")
    assert restaurant.stops == []
    count = len(restaurant.messages("round_forecast"))
    restaurant.run(10.0)
    assert len(restaurant.messages("round_forecast")) == count, "nothing is left to say"


def test_with_trays_the_kitchen_comes_again() -> None:
    restaurant = Restaurant(trays=1).order("table_5", "table_9")
    restaurant.until("loading", "kitchen")
    assert restaurant.stops == ["table_5", "kitchen", "table_9", "home"]


def test_the_number_of_trays_cannot_change_at_run_time() -> None:
    restaurant = Restaurant(trays=1).order("table_5", "table_9")
    restaurant.until("loading", "kitchen")
    with pytest.raises(UserError, match="trays"):
        restaurant.system.set_params("delivery", {"trays": 2}, "test")
    restaurant.until("waiting", "table_5")
    assert restaurant.now.on_trays == ("table_5",)


def test_the_battery_is_forecast_from_its_status() -> None:
    restaurant = Restaurant()
    battery = BatteryStatus(PLAIN, "ok", 0.8, 1e5, 10.0, 20.0, 4.0)
    restaurant.publish("battery_status", battery)
    restaurant.order("table_5", "table_19").until("loading", "kitchen")
    charges = [stop.charge for stop in restaurant.forecast.stops]
    assert 0.8 > charges[0] > charges[1] > charges[2] > 0.5


def test_the_routes_are_those_of_the_latest_map() -> None:
    restaurant = Restaurant().order("table_5", "table_9")
    restaurant.until("loading", "kitchen")
    restaurant.put("kitchen")
    before = [stop.distance for stop in restaurant.forecast.stops]
    narrow = walled(20.0, 4.0)
    column = WALL + round(7.0 / RESOLUTION)
    narrow.cells[WALL : WALL + round(3.0 / RESOLUTION), column] = 100
    restaurant.publish("map", OccupancyGrid.of(PLAIN, narrow))
    after = [stop.distance for stop in restaurant.forecast.stops]
    assert after[0] == before[0] and after[1] > before[1] + 0.3, "around the new wall"
    node = restaurant.system.nodes["delivery"]
    assert isinstance(node, DeliveryForecastNode) and len(node._lengths) == 2, "none of the old map is kept"


def test_a_table_without_a_path_is_left_out_of_the_forecast() -> None:
    restaurant = Restaurant()
    closed = walled(20.0, 4.0)
    closed.cells[:, WALL + round(7.0 / RESOLUTION)] = 100
    restaurant.publish("map", OccupancyGrid.of(PLAIN, closed))
    restaurant.order("table_5", "table_9", "table_3").until("loading", "kitchen")
    restaurant.put("kitchen")
    stops = restaurant.forecast.stops
    assert [stop.reachable for stop in stops] == [True, False, True, True]
    assert [stop.distance for stop in stops[:3]] == pytest.approx([4.0, 0.0, 6.0], abs=0.2)


def test_a_table_in_a_keep_out_zone_has_no_path() -> None:
    restaurant = Restaurant().order("table_5", "table_9")
    restaurant.until("loading", "kitchen")
    restaurant.put("kitchen")
    assert all(stop.reachable for stop in restaurant.forecast.stops)
    corners = tuple(Point(x, y) for x, y in ((8.0, 1.0), (10.0, 1.0), (10.0, 3.0), (8.0, 3.0)))
    restaurant.publish("zones", MapZones(PLAIN, (MapZone("guests", KEEP_OUT, corners),)))
    assert [stop.reachable for stop in restaurant.forecast.stops] == [True, False, True]


def test_a_table_behind_a_lane_has_no_path_and_is_named() -> None:
    restaurant = Restaurant()
    corners = tuple(Point(x, y) for x, y in ((7.0, -0.1), (8.0, -0.1), (8.0, 4.1), (7.0, 4.1)))
    to_the_kitchen = MapZone("lane", ONE_WAY, corners, direction=math.pi)
    restaurant.publish("zones", MapZones(PLAIN, (to_the_kitchen,)))
    for _ in range(2):  # a request that was not acknowledged is repeated
        restaurant.order("table_5", "table_9", "12")
    assert restaurant.notices() == ["No path on the map to: table 9 and table 12. The order is kept."]
    restaurant.until("loading", "kitchen")
    restaurant.put("kitchen")
    assert [stop.reachable for stop in restaurant.forecast.stops] == [True, False, False, True]
    away_from_the_kitchen = MapZone("lane", ONE_WAY, corners)
    restaurant.publish("zones", MapZones(PLAIN, (away_from_the_kitchen,)))
    assert [stop.reachable for stop in restaurant.forecast.stops] == [True, True, True, False], "no way home"


def test_without_a_map_there_is_no_forecast() -> None:
    runner = DeliveryRunner()
    runner.publish("order", Order(("table_1",), "a"))
    runner.until("loading", "kitchen")
    runner.run(3.0)
    assert runner.messages("round_forecast") == []


def test_the_tables_that_are_left_are_sorted() -> None:
    restaurant = Restaurant().order("table_5", "table_16", "table_3", "table_12", "table_8")
    restaurant.until("waiting", "table_5")
    restaurant.publish("round_shortest", String("a"))
    queue = restaurant.now.queue
    assert sorted(queue) == ["table_12", "table_16", "table_3", "table_8"]
    ends = [float(name[6:]) for name in ("table_5", *queue)]
    driven = sum(abs(a - b) for a, b in itertools.pairwise(ends)) + abs(ends[-1] - 1.5)
    assert driven == pytest.approx(11.0 + 14.5), "to the end of the hall and back"


@pytest.mark.parametrize("order", ["", "b"])
def test_another_round_is_not_sorted(order: str) -> None:
    restaurant = Restaurant().order("table_5", "table_16", "table_3")
    restaurant.publish("round_shortest", String(order))
    assert restaurant.now.queue == ("table_5", "table_16", "table_3")
    assert restaurant.notices() == [QUEUE_CHANGED]


def test_what_cannot_be_sorted_is_refused_with_a_reason() -> None:
    restaurant = Restaurant()
    restaurant.publish("round_shortest", String("a"))
    restaurant.order(*(f"table_{x}" for x in range(2, 16)))
    restaurant.publish("round_shortest", String("a"))
    assert restaurant.notices()[0] == ROUTES_NOT_KNOWN and "12 tables" in restaurant.notices()[1]
    assert restaurant.now.queue == tuple(f"table_{x}" for x in range(2, 16))
    restaurant.publish("loaded", Empty())
