"""What is published on one side of the bridge is received on the other: once, whole, and late where it is latched."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.ros2.dds.other import Peer
from tests.support.waiting import wait_for

from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav_msgs import MapMetaData, OccupancyGrid
from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import SENSOR_DATA, TRANSIENT_LOCAL, TRANSIENT_LOCAL_QOS, QoS

pytest.importorskip("cyclonedds", reason="needs Cyclone DDS: pip install 'chefbot[dds]'")

from tests.ros2.dds import peer as peer_types

from chefbot.ros2.dds.bridge import DdsBridge
from chefbot.ros2.dds.types import idl_struct


def test_dds_receives_messages_of_the_robot(
    robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    scan = LaserScan(Header.of(1, "laser"), ranges=np.full(640, 2.5, np.float32))
    picture = Image(height=480, width=640, encoding="rgb8", step=1920, data=np.full(921_600, 3, np.uint8))
    scans, pictures = robot.publisher("scan", LaserScan), robot.publisher("image", Image, SENSOR_DATA)
    peer = peers()
    peer.read("rt/robot1/scan", "LaserScan")
    peer.read("rt/robot1/image", "Image", "best_effort")
    wait_for(lambda: scans.has_subscribers and pictures.has_subscribers, "a listener")

    def exchanged(publisher: Any, message: Any, topic: str) -> Any:
        publisher.publish(message)
        return peer.take(topic)

    got = wait_for(lambda: exchanged(scans, scan, "rt/robot1/scan"), "a scan")
    assert got[0] == ["laser", 640, 1600.0]
    got = wait_for(lambda: exchanged(pictures, picture, "rt/robot1/image"), "a picture")
    assert got[0] == [480, 640, "rgb8", 921_600, 3 * 921_600]


def test_type_information_equals_that_of_ros_2() -> None:
    """Fast DDS 3 connects only ends that announce the same type; to ROS 2's DDS layers a byte is uint8."""
    ours, by_hand = (
        one.__idl__.get_type_info() for one in (idl_struct(DiagnosticArray), peer_types.DiagnosticArray_)
    )
    assert ours.minimal.typeid_with_size == by_hand.minimal.typeid_with_size
    assert ours.complete.typeid_with_size == by_hand.complete.typeid_with_size


def test_the_robot_receives_commands_from_dds(
    robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    received: list[Twist] = []
    robot.subscription("cmd_vel_teleop", Twist, received.append)
    peer = peers()
    peer.write("rt/robot1/cmd_vel_teleop", "Twist")
    wait_for(lambda: peer.matched("rt/robot1/cmd_vel_teleop") == 1, "the robot's reader on DDS")
    peer.publish("rt/robot1/cmd_vel_teleop", 0.25, -0.5)  # once: from a matched writer it arrives
    wait_for(lambda: received, "the command")
    assert (received[0].linear.x, received[0].angular.z) == (0.25, -0.5)
    assert len(received) == 1


def test_latched_messages_reach_late_dds_subscribers(
    robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    info = MapMetaData(resolution=0.05, width=300, height=200)
    grid = OccupancyGrid(Header.of(1, "map"), info, np.ones(60_000, np.int8))
    maps = robot.publisher("/map", OccupancyGrid, TRANSIENT_LOCAL_QOS)
    maps.publish(grid)
    one, two = (
        robot.publisher("/two", String, TRANSIENT_LOCAL_QOS),
        robot.publisher("/two", String, TRANSIENT_LOCAL_QOS),
    )
    two.publish(String("of the second"))
    one.publish(String("old"))
    one.publish(String("of the first"))
    wait_for(lambda: {"/map", "/two"} <= set(bridge.topics.outward), "the topics")
    peer = peers()
    peer.read("rt/map", "OccupancyGrid", "latched")
    peer.read("rt/two", "String", "latched all")
    assert wait_for(lambda: peer.take("rt/map"), "the map") == [["map", 300, 200, 60_000, 60_000]]
    got: list[str] = []
    wait_for(lambda: got.extend(peer.take("rt/two")) or len(got) >= 2, "both publishers' last messages")
    assert sorted(got) == ["of the first", "of the second"]


def test_latched_dds_messages_reach_late_subscribers(
    robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    peer = peers()
    peer.write("rt/note", "String", "latched")
    peer.publish("rt/note", "published early")
    wait_for(lambda: "/note" in bridge.topics.inward, "the topic")
    received: list[str] = []
    robot.subscription(
        "/note", String, lambda one: received.append(one.data), QoS(durability=TRANSIENT_LOCAL)
    )
    wait_for(lambda: received, "the early message")
    later: list[str] = []
    robot.subscription("/note", String, lambda one: later.append(one.data), QoS(durability=TRANSIENT_LOCAL))
    wait_for(lambda: later, "the same for a second listener")
    assert (received, later) == (["published early"], ["published early"])


@pytest.mark.slow
def test_no_message_is_echoed_back(robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    """A topic on which both sides publish and subscribe, as /tf: each message once on either side."""
    received: list[str] = []
    robot.subscription("/both", String, lambda one: received.append(one.data))
    ours = robot.publisher("/both", String)
    peer = peers()
    peer.read("rt/both", "String")
    peer.write("rt/both", "String")
    wait_for(lambda: peer.matched("rt/both") == peer.sources("rt/both") == 2, "itself and the bridge")
    wait_for(lambda: len(robot.wire.graph.topics()["/both"].consumers) == 2, "the bridge's listener on Zenoh")
    peer.take("rt/both")
    received.clear()
    for number in range(50):
        ours.publish(String(f"zenoh {number}"))
        peer.publish("rt/both", f"dds {number}")
    sent = {f"zenoh {n}" for n in range(50)} | {f"dds {n}" for n in range(50)}
    got: list[str] = []
    wait_for(lambda: got.extend(peer.take("rt/both")) or len(got) >= 100, "all on DDS")
    wait_for(lambda: len(received) >= 100, "all on Zenoh")
    time.sleep(0.3)  # what goes round in a circle would come now
    got.extend(peer.take("rt/both"))
    assert len(got) == len(received) == 100
    assert set(got) == set(received) == sent


def test_a_best_effort_writer_is_received(
    robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    """On DDS alone a reliable listener would not match it."""
    received: list[Twist] = []
    robot.subscription("/soft", Twist, received.append)
    peer = peers()
    peer.write("rt/soft", "Twist", "best_effort")

    def arrives() -> bool:
        peer.publish("rt/soft", 1.0, 2.0)
        return bool(received)

    wait_for(arrives, "the message")


@pytest.mark.parametrize("cut", [1, 4, 40])
def test_truncated_messages_from_zenoh_are_counted(
    robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer], cut: int
) -> None:
    ours = robot.publisher("/speed", Twist)
    peer = peers()
    peer.read("rt/speed", "Twist")
    wait_for(lambda: ours.has_subscribers and peer.sources("rt/speed"), "a listener")
    ours.publish_cdr(Twist.of(0.5, 0.0).to_cdr()[:-cut])
    reasons = wait_for(bridge.rejected.counts, "the refusal")
    assert [one for one in reasons if one.startswith("/speed: ")]
    ours.publish(Twist.of(0.25, 0.0))
    assert wait_for(lambda: peer.take("rt/speed"), "the next one") == [[0.25, 0.0]]


@pytest.mark.slow
def test_a_flood_from_dds_is_survived(robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    """What goes too fast may be lost; the rest goes on and so do other topics."""
    received: list[Twist] = []
    calm: list[str] = []
    robot.subscription("/speed", Twist, received.append)
    robot.subscription("/calm", String, lambda one: calm.append(one.data))
    peer = peers()
    peer.write("rt/speed", "Twist")
    peer.write("rt/calm", "String")
    wait_for(lambda: peer.matched("rt/speed") and peer.matched("rt/calm"), "two readers")
    peer.flood("rt/speed", 20_000, 0.1, 0.0)
    peer.publish("rt/calm", "still here")
    wait_for(lambda: calm, "the other topic")
    assert received
