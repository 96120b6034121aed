"""What a delivery round knows of its routes: their lengths over the stops, and the nearest place to park."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.planning.rooms import two_rooms, walled
from tests.support.nodes import ROBOT, NodeRunner

from chefbot.delivery.params import DeliveryParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import Place, Places
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.deliveries.energy import DeliveryEnergyNode

ROBOT_POSE = SE2(1.0, 2.0, 0.0)
PLACES = {"home": SE2(1.0, 1.0, 0.0), "table_1": SE2(3.0, 2.0, 0.0), "table_2": SE2(6.0, 2.0, 0.0)}


class RoutesOnly(DeliveryEnergyNode):
    """The base class alone."""

    params: DeliveryParams


class Floor(NodeRunner):
    """Two rooms with a door, the robot in the left one, and three places."""

    def __init__(self) -> None:
        super().__init__({"routes": f"{__name__}:RoutesOnly"}, {})
        self.node: Any = self.system.nodes["routes"]

    def send(self, topic: str, message: Any) -> None:
        self.loop.publish(topic, message, "test", from_device=True)
        self.run(0.0)

    def send_map(self, grid: Grid | None = None) -> Floor:
        self.send("map", OccupancyGrid.of(Header.of(0, "map"), grid or two_rooms(door=1.0)))
        return self

    def send_places(self, **places: SE2) -> Floor:
        stamped = {name: PoseStamped(Header.of(0, "map"), Pose.of(pose)) for name, pose in places.items()}
        self.send("places", Places(tuple(Place(name, pose) for name, pose in stamped.items())))
        return self

    def localize(self, pose: SE2 = ROBOT_POSE) -> Floor:
        for parent, child, at in (("map", "odom", pose), ("odom", "base_link", IDENTITY)):
            self.send("tf", TFMessage((TransformStamped.of(self.loop.now_ns, parent, child, at),)))
        return self

    def length(self, *stops: Any) -> float:
        return float(self.node._length(stops))


@pytest.fixture
def floor() -> Floor:
    return Floor().send_map().send_places(**PLACES).localize()


def test_a_route_leads_from_the_robot_over_all_stops(floor: Floor) -> None:
    assert floor.length("table_1") == pytest.approx(2.0, rel=0.1)
    assert floor.length("table_2") == pytest.approx(5.0, rel=0.1)
    assert floor.length("table_1", "table_2") == pytest.approx(2.0 + 3.0, rel=0.1)
    assert floor.length("table_2", "table_1", "home") == pytest.approx(5.0 + 3.0 + math.sqrt(5.0), rel=0.12)


def test_a_stop_may_be_a_pose(floor: Floor) -> None:
    pose = PoseStamped(Header.of(0, "map"), Pose.of(PLACES["table_2"]))
    assert floor.length(pose, "table_1") == floor.length("table_2", "table_1")


def test_a_route_follows_the_rooms(floor: Floor) -> None:
    """From one side of the wall to the other it leads down to the door, and near walls it costs more."""
    floor.send_places(table_1=SE2(4.7, 3.4, 0.0)).localize(SE2(3.3, 3.4, 0.0))
    around = 2.0 * math.hypot(0.7, 1.0)
    assert around <= floor.length("table_1") <= 1.7 * around


def test_a_route_without_stops_has_no_length(floor: Floor) -> None:
    assert floor.length() == 0.0


def test_without_map_pose_or_place_the_length_is_not_known() -> None:
    assert math.isnan(Floor().send_places(**PLACES).localize().length("table_1"))
    assert math.isnan(Floor().send_map().send_places(**PLACES).length("table_1"))
    floor = Floor().send_map().send_places(**PLACES).localize()
    assert math.isnan(floor.length("table_9")) and math.isnan(floor.length("table_1", "table_9"))
    assert floor.length("table_1") > 0.0


def test_routes_are_those_of_the_latest_map(floor: Floor) -> None:
    before = floor.length("table_2")
    floor.send_map(walled(8.0, 4.0))
    assert floor.length("table_2") == pytest.approx(5.0, rel=0.02) and before >= floor.length("table_2")
    closed = two_rooms(door=1.0)
    closed.cells[:, 80:84] = 100
    floor.send_map(closed)
    assert floor.length("table_2") == pytest.approx(1.5 * 5.0), "half as much again where no path is known"


def test_a_parking_place_is_at_a_wall_and_the_nearest(floor: Floor) -> None:
    pose, length = floor.node._parking_place()
    at = pose.pose.se2
    assert pose.header.frame_id == "map"
    walls = min(at.x, 8.0 - at.x, at.y, 4.0 - at.y, abs(at.x - 4.0))
    assert ROBOT.circumscribed_radius < walls < ROBOT.circumscribed_radius + 0.4
    assert length == pytest.approx(at.distance(ROBOT_POSE), abs=0.4) and length < 2.0
    floor.localize(SE2(7.0, 1.0, 0.0))
    other, length = floor.node._parking_place()
    assert other.pose.se2.x > 4.0 and length < 2.0, "from where the robot is now"


def test_no_parking_where_people_are_served(floor: Floor) -> None:
    free, _ = floor.node._parking_place()
    taken = free.pose.se2
    floor.send_places(home=PLACES["home"], table_1=taken)
    other, _ = floor.node._parking_place()
    assert other.pose.se2.distance(taken) > ROBOT.circumscribed_radius + 0.4
    floor.send_places(home=taken, table_1=PLACES["table_1"])
    again, _ = floor.node._parking_place()
    assert again.pose.se2 == taken, "no one is served at home"


def test_without_map_or_pose_there_is_no_parking_place() -> None:
    assert Floor().localize().node._parking_place() is None
    assert Floor().send_map().node._parking_place() is None
    full = Grid(np.full((40, 40), 100, np.int8), 0.05, 0.0, 0.0)
    assert Floor().send_map(full).localize().node._parking_place() is None
