"""Endpoints, their types and QoS are announced on both sides; what does not fit is named."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.ros2.dds.other import LOOPBACK, Peer
from tests.support.waiting import PATIENCE, wait_for

from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import SENSOR_DATA

pytest.importorskip("cyclonedds", reason="needs Cyclone DDS: pip install 'chefbot[dds]'")

from chefbot.ros2.dds.bridge import DdsBridge


def test_graph_is_announced_as_in_ros(robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    """User data, and which node has which GIDs."""
    robot.publisher("scan", LaserScan)
    robot.subscription("cmd_vel", Twist, lambda _: None)
    peer = peers()
    readers = wait_for(lambda: peer.ends("readers"), "a reader")
    assert ["rt/robot1/cmd_vel", "geometry_msgs::msg::dds_::Twist_"] in [one[:2] for one in readers]
    writer = wait_for(
        lambda: [one for one in peer.ends("writers") if one[0] == "rt/robot1/scan"], "the scan's writer"
    )[0]
    assert writer[1:3] == [
        "sensor_msgs::msg::dds_::LaserScan_",
        f"typehash={InterfaceType.of(LaserScan).hash};",
    ]
    reader = next(one for one in readers if one[0] == "rt/robot1/cmd_vel")
    graph = wait_for(
        lambda: [one for one in peer.graph() if one == ["/robot1/base", [reader[3]], [writer[3]]]],
        "the node with both",
    )
    assert len(graph) == 1
    assert "/chefbot_dds" in [one[0] for one in peer.graph()]
    assert peer.participants() == ["enclave=/;"]


def test_zenoh_side_sees_the_dds_endpoints(
    robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    peer = peers()
    peer.write("rt/far", "Twist", "best_effort")
    graph = robot.wire.graph
    wait_for(lambda: "/far" in graph.topics() and graph.topics()["/far"].providers, "a publisher")
    end = graph.topics()["/far"].providers[0].info
    assert end.type == InterfaceType.of(Twist)
    assert not end.qos.reliable
    peer.forget("rt/far")
    wait_for(lambda: "/far" not in graph.topics(), "its end")


def test_unknown_and_conflicting_types_are_reported(
    robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]
) -> None:
    received: list[Twist] = []
    robot.subscription("/clash", Twist, received.append)
    robot.raw_publisher("/foreign", InterfaceType("elsewhere_msgs/msg/Other", "RIHS01_" + "0" * 64))
    peer = peers()
    peer.write("rt/strange", "Unknown")
    peer.write("rt/clash", "String")
    peer.write("rt/version", "String", "", "RIHS01_" + "1" * 64)
    left_out = wait_for(
        lambda: len(bridge.topics.left_out) >= 4 and bridge.topics.left_out, "four topics left out"
    )
    assert "elsewhere_msgs/msg/Unknown" in left_out["/strange"]
    assert "elsewhere_msgs/msg/Other" in left_out["/foreign"]
    assert "std_msgs/msg/String" in left_out["/clash"]
    assert "std_msgs/msg/String" in left_out["/version"]
    peer.publish("rt/clash", "no twist")
    ours = robot.publisher("/alive", String)
    peer.read("rt/alive", "String")
    wait_for(lambda: ours.has_subscribers, "the bridge that goes on")
    assert not received


@pytest.mark.slow
def test_incompatible_qos_is_reported(robot: RmwNode, bridge: DdsBridge, peers: Callable[[], Peer]) -> None:
    """DDS itself is silent about both."""
    robot.subscription("/cut", Twist, lambda _: None)
    robot.publisher("/soft", LaserScan, SENSOR_DATA)
    peer = peers()
    peer.write("rt/cut", "Shorter")
    peer.read("rt/soft", "LaserScan")
    left_out = wait_for(
        lambda: {"/cut", "/soft"} <= bridge.topics.left_out.keys() and bridge.topics.left_out, "two sentences"
    )
    assert "other fields" in left_out["/cut"]
    assert "/robot1/base does not match" in left_out["/soft"]
    assert "best effort is offered" in left_out["/soft"]


@pytest.mark.slow
def test_cyclone_dds_tool_reads_the_types(robot: RmwNode, bridge: DdsBridge, domain: int) -> None:
    """`cyclonedds typeof` prints as IDL the type that it has discovered."""
    tool = Path(sys.executable).with_name("cyclonedds")
    robot.publisher("/scan", LaserScan)
    wait_for(lambda: "/scan" in bridge.topics.outward, "the topic")
    command = [str(tool), "typeof", "rt/scan", "-i", str(domain), "--color", "none"]

    def printed() -> str:
        environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
        found = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, env=environment)
        return found.stdout if "LaserScan_" in found.stdout else ""

    idl = wait_for(printed, "the type")
    fields = [line.split()[-1].rstrip(";") for line in idl.splitlines() if line.strip().endswith(";")]
    names = [one for one in fields if one.isidentifier()]
    assert names[-10:] == ["header", *LaserScan.__struct_fields__[1:]]
