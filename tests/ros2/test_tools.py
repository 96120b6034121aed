"""The verbs of the wire, as a user types them, with nodes that are not ours to look into."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from tests.support.waiting import PATIENCE, wait_for

from chefbot.cli.app import main
from chefbot.msgs import rcl_interfaces as rcl
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.geometry_msgs import PoseStamped, Twist
from chefbot.msgs.idl.definition import describe, type_hash
from chefbot.msgs.idl.message import Float64, Message, Uint8
from chefbot.msgs.nav2_msgs import NavigateToPose
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.type_description_interfaces import (
    GetTypeDescription,
    GetTypeDescription_Response,
    TypeDescription,
)
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK, SENSOR_DATA, TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.tools.common import ToolError
from chefbot.ros2.tools.graph import write_graph
from chefbot.ros2.tools.graph_dot import to_dot
from chefbot.ros2.tools.meter import Meter
from chefbot.ros2.tools.topic_echo import rate_line

STORE = {
    "max_speed": rcl.ParameterValue(type=rcl.DOUBLE, double_value=0.35),
    "frames": rcl.ParameterValue(type=rcl.STRING_ARRAY, string_array_value=("map", "odom")),
}
Thing = msgspec.defstruct(
    "Thing",
    [("size", Float64, 0.0), ("kind", Uint8, 0)],
    bases=(Message,),
    module="their_msgs",
    frozen=True,
    eq=False,
)
"""A type that chefbot has no definition of."""


@pytest.fixture
def verb(
    wire: RmwContext, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """`verb("topic", "list")` is exit code, output and errors."""
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", str(wire._port))
    monkeypatch.setenv("ROS_DOMAIN_ID", str(wire.domain))
    monkeypatch.setattr("chefbot.ros2.tools.common.SETTLED_TIME", 0.08)
    monkeypatch.setattr("chefbot.ros2.tools.common.NAME_WAIT", 0.1)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["chefbot", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        return (int(str(end.value.code or 0)), *capsys.readouterr())

    return run


@pytest.fixture
def base(wire: RmwContext) -> Iterator[RmwNode]:
    """Nodes of a small robot; the scan and a foreign type are published periodically."""
    stop = threading.Event()
    with RmwNode(wire, "base", "/r") as node, RmwNode(wire, "slam", "/r") as slam:
        scan = node.publisher("scan", LaserScan, SENSOR_DATA)
        slam.subscription("scan", LaserScan, lambda _: None, SENSOR_DATA)
        slam.publisher("map", OccupancyGrid, TRANSIENT_LOCAL_QOS).publish(OccupancyGrid())
        node.publisher("silent", String)
        foreign = node.publisher("thing", Thing)
        node.server("~/list_parameters", rcl.ListParameters, lambda call: call.respond(_listed()))
        node.server(
            "~/get_parameters", rcl.GetParameters, lambda call: call.respond(_got(call.request.names))
        )
        node.server("~/set_parameters", rcl.SetParameters, lambda call: call.respond(_set(call.request)))

        def publish() -> None:
            while not stop.wait(0.02):
                scan.publish(LaserScan(Header(frame_id="laser"), ranges=np.arange(640, dtype=np.float32)))
                foreign.publish(Thing(2.5, 7))

        thread = threading.Thread(target=publish)
        thread.start()
        yield node
        stop.set()
        thread.join()


def _listed() -> Message:
    return rcl.ListParameters_Response(rcl.ListParametersResult(tuple(STORE)))


def _got(names: tuple[str, ...]) -> Message:
    return rcl.GetParameters_Response(tuple(STORE[name] for name in names))


def _set(request: rcl.SetParameters_Request) -> Message:
    fits = [one.value.double_value <= 1.0 for one in request.parameters]
    results = tuple(rcl.SetParametersResult(one, "" if one else "must not be above 1") for one in fits)
    return rcl.SetParameters_Response(results)


@pytest.mark.slow
def test_topic_list_info_echo_and_hz_work(verb: Callable, base: RmwNode) -> None:
    code, out, _ = verb("topic", "list")
    assert code == 0 and out.split() == ["/r/map", "/r/scan", "/r/silent", "/r/thing"]
    rows = [line.split() for line in verb("topic", "list", "-v")[1].splitlines()]
    assert ["/r/scan", "sensor_msgs/msg/LaserScan", "1", "1"] in rows
    info = verb("topic", "info", "r/scan")[1]
    assert "/r/base  best effort, volatile, keep last 5" in info and "!" not in info
    shown = yaml.safe_load(verb("topic", "echo", "/r/scan", "--once")[1])
    assert shown["header"]["frame_id"] == "laser" and shown["ranges"][128] == "... 512 more"
    assert verb("topic", "echo", "/r/scan", "--once", "--field", "ranges[3]")[1].strip() == "3.0"
    assert verb("topic", "echo", "/r/map", "--once", "--field", "info.resolution")[1].strip() == "0.0"
    code, out, _ = verb("topic", "hz", "/r/scan", "--duration", "1")
    assert code == 0 and 1 < float(out.split()[1]) < 100 and "kB/s" in out  # 50, but late ones bunch
    code, out, _ = verb("topic", "hz", "/r/map", "--duration", "1")
    assert code == 1 and "no message" in out, "the stored one came before"


@pytest.mark.slow
def test_an_unknown_topic_is_named_with_its_nearest(verb: Callable, base: RmwNode) -> None:
    for arguments, nearest in (
        (("topic", "hz", "/r/scam"), "'/r/scan'"),
        (("topic", "echo", "/r/scan", "--field", "header.framed"), "'frame_id'"),
        (("node", "info", "/r/bas"), "'/r/base'"),
        (("service", "call", "/r/base/get_parameter"), "'/r/base/get_parameters'"),
        (("param", "get", "/r/base", "max_sped"), "'max_speed'"),
    ):
        code, out, errors = verb(*arguments)
        assert (code, out) == (2, "") and f"did you mean {nearest}?" in errors


@pytest.mark.slow
def test_a_silent_topic_is_explained(verb: Callable, base: RmwNode, wire: RmwContext) -> None:
    with RmwNode(wire, "rviz") as rviz:
        rviz.subscription("/r/silent", Twist, lambda _: None)
        rviz.subscription("/r/scan", LaserScan, lambda _: None)
        code, out, errors = verb("topic", "hz", "/r/silent", "--duration", "1")
        assert code == 1 and "no message" in out
        assert "/r/silent has no messages, although /r/base publish it" in errors
        assert "one has std_msgs/msg/String, the other geometry_msgs/msg/Twist" in errors
        assert "! /r/scan: /r/base and /rviz: best effort is offered" in verb("topic", "info", "/r/scan")[1]
        doctor = verb("doctor")[1]
        assert "3 nodes" in doctor and "! /r/silent: /r/base and /rviz cannot communicate" in doctor


@pytest.mark.slow
def test_an_undescribed_type_is_named_with_its_hash(verb: Callable, base: RmwNode) -> None:
    code, _, errors = verb("topic", "echo", "/r/thing", "--once")
    assert code == 2 and f"their_msgs/msg/Thing ({type_hash(Thing)[:19]}...)" in errors
    assert verb("topic", "hz", "/r/thing", "--duration", "0.5")[0] == 0


def test_a_type_described_by_its_node_is_printed(verb: Callable, base: RmwNode) -> None:
    response = GetTypeDescription_Response(True, "", TypeDescription.of(describe(Thing)))
    base.server("~/get_type_description", GetTypeDescription, lambda call: call.respond(response))
    code, out, _ = verb("topic", "echo", "/r/thing", "--once")
    assert (code, yaml.safe_load(out)) == (0, {"size": 2.5, "kind": 7})


def test_a_known_type_of_another_version_is_refused(verb: Callable, base: RmwNode) -> None:
    base.raw_publisher("odd", InterfaceType("geometry_msgs/msg/Twist", "RIHS01_" + "0" * 64))
    code, _, errors = verb("topic", "echo", "/r/odd", "--once")
    assert code == 2 and "another version" in errors and InterfaceType.of(Twist).hash in errors


@pytest.mark.slow
def test_a_topic_with_two_types_prints_the_known_one(verb: Callable, base: RmwNode) -> None:
    name = "two"
    base.raw_publisher(
        name, InterfaceType("geometry_msgs/msg/Twist", "RIHS01_" + "0" * 64), TRANSIENT_LOCAL_QOS
    ).publish_cdr(b"?")
    base.publisher(name, String, TRANSIENT_LOCAL_QOS).publish(String("known"))
    out = verb("topic", "echo", "/r/two", "--duration", "1.5")[1]
    assert "{data: known}" in out and "# not shown" in out and "another version" in out


@pytest.mark.slow
def test_topic_pub_publishes_messages(verb: Callable, base: RmwNode) -> None:
    received: list[Twist] = []
    base.subscription("cmd_vel", Twist, received.append)
    assert verb("topic", "pub", "/r/cmd_vel", "{linear: {x: 0.25}}", "--once")[0] == 0
    assert verb("topic", "pub", "/r/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.5}}", "--once")[0] == 0
    until = time.monotonic() + PATIENCE
    while len(received) < 2 and time.monotonic() < until:
        time.sleep(0.01)
    assert [one.linear.x for one in received] == [0.25, 0.5]
    code, _, errors = verb("topic", "pub", "/r/cmd_vel", "{liner: 1}", "--once")
    assert code == 2 and "'linear'" in errors
    code, _, errors = verb("topic", "pub", "/nobody", "{data: x}", "--once")
    assert code == 2 and "its type must be given" in errors


@pytest.mark.slow
def test_now_is_the_time_of_a_simulated_robot(verb: Callable, base: RmwNode) -> None:
    received: list[PoseStamped] = []
    base.subscription("deep/goal_pose", PoseStamped, received.append)
    clock, stop = base.publisher("clock", Clock, CLOCK), threading.Event()

    def publish() -> None:
        while not stop.wait(0.02):
            clock.publish(Clock(Time.of(12_500_000_000)))

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        assert verb("topic", "pub", "/r/deep/goal_pose", "{header: {stamp: now}}", "--once")[0] == 0
    finally:
        stop.set()
        thread.join()
    wait_for(lambda: received)
    assert received[0].header.stamp.ns == 12_500_000_000


@pytest.mark.slow
def test_parameter_and_node_commands_work(verb: Callable, base: RmwNode) -> None:
    assert verb("node", "list")[1].split() == ["/r/base", "/r/slam"]
    assert "/r/scan" in verb("node", "info", "/r/base")[1]
    assert yaml.safe_load(verb("param", "get", "/r/base", "frames")[1]) == ["map", "odom"]
    assert "max_speed  0.35" in verb("param", "list")[1]
    assert verb("param", "set", "/r/base", "max_speed", "1")[0] == 0
    code, out, _ = verb("param", "set", "/r/base", "max_speed", "3")
    assert code == 1 and "must not be above 1" in out
    code, _, errors = verb("param", "set", "/r/base", "frames", "3")
    assert code == 2 and "string array" in errors


@pytest.mark.slow
def test_services_and_actions_of_another_process_are_called(
    verb: Callable, wire: RmwContext, other: Callable
) -> None:
    other("peer")
    assert wire.graph.wait_for(lambda graph: "/far/navigate_to_pose" in graph.actions(), PATIENCE)
    answer = yaml.safe_load(verb("service", "call", "/far/switch", "{data: true}")[1])
    assert answer == {"success": True, "message": "from the other process"}
    assert verb("action", "list")[1].split() == ["/far/navigate_to_pose"]
    code, out, _ = verb("action", "send", "/far/navigate_to_pose", "{pose: {pose: {position: {x: 1}}}}")
    assert code == 0 and out.count("feedback:") == 3 and out.rstrip().endswith("status: succeeded")
    code, out, _ = verb("action", "send", "/far/navigate_to_pose", "{behavior_tree: unwanted}")
    assert code == 1 and "rejected; /far/navigate_to_pose rejected the goal" in out


@pytest.mark.slow
def test_ctrl_c_cancels_a_goal(verb: Callable, wire: RmwContext, base: RmwNode, other: Callable) -> None:
    """It comes with the first feedback, so the goal runs."""
    other("peer")
    assert wire.graph.wait_for(lambda graph: "/far/navigate_to_pose" in graph.actions(), PATIENCE)
    pressed = threading.Event()

    def press(_: Message) -> None:
        if not pressed.is_set():
            pressed.set()
            os.kill(os.getpid(), signal.SIGINT)

    topic = "/far/navigate_to_pose/_action/feedback"
    base.subscription(topic, NavigateToPose.feedback_message, press)
    code, out, errors = verb("action", "send", "/far/navigate_to_pose", "{behavior_tree: slow}", "--quiet")
    assert code == 1 and "status: cancelled" in out and "cancelling" in errors


@pytest.mark.slow
def test_the_graph_is_drawn_and_exported_as_json(verb: Callable, base: RmwNode, tmp_path: Path) -> None:
    out = tmp_path / "graph.dot"
    assert verb("node", "graph", "--out", str(out), "--duration", "1")[0] == 0
    text = out.read_text()
    assert '"/r/base" -> "topic /r/scan"' in text and '"topic /r/scan" -> "/r/slam"' in text and " Hz" in text
    found = json.loads(verb("node", "graph", "--json", "--duration", "1")[1])
    (scan,) = [one for one in found["topics"] if one["name"] == "/r/scan"]
    assert scan["publishers"] == ["/r/base"] and scan["subscriptions"] == ["/r/slam"]
    assert 1 < scan["hz"] <= 51 and found["nodes"] == ["/r/base", "/r/slam"]


@pytest.mark.slow
def test_bag_record_and_info_do_not_drive_a_running_robot(
    verb: Callable, base: RmwNode, wire: RmwContext, tmp_path: Path
) -> None:
    bag = str(tmp_path / "bag")
    with RmwNode(wire, "teleop") as teleop:
        teleop.publisher("/cmd_vel", Twist, TRANSIENT_LOCAL_QOS).publish(Twist.of(0.3, 0.0))
        code, out, errors = verb("bag", "record", "-o", bag, "--duration", "1.5")
        assert code == 0 and "on 5 topics" in out and errors == ""
        info = verb("bag", "info", bag)
        assert info[0] == 0 and ["/r/thing", "their_msgs/msg/Thing"] in [
            line.split()[:2] for line in info[1].splitlines()
        ]
        code, _, errors = verb("bag", "play", bag)
        assert code == 2 and "other nodes publish on all topics" in errors
        received: list[Twist] = []
        base.subscription("/cmd_vel", Twist, received.append)
        assert (
            verb("bag", "play", bag, "--topics", "/cmd_vel", "--rate", "100")[0] == 0 and len(received) == 1
        )
    assert wire.graph.wait_for(lambda graph: not graph.topics()["/cmd_vel"].providers, PATIENCE)
    code, out, errors = verb("bag", "play", bag, "--rate", "100")
    assert code == 0 and "played 1 messages" in out and "/r/scan" in errors
    assert [one.linear.x for one in received] == [0.3, 0.3]


@pytest.mark.slow
def test_an_empty_network_is_reported_in_one_sentence(
    port: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", str(port))
    monkeypatch.setattr("chefbot.ros2.tools.common.START_WAIT", 0.2)
    monkeypatch.setattr(sys, "argv", ["chefbot", "topic", "list"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2 and "no ROS nodes found at" in capsys.readouterr().err
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", "seven")
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2 and "CHEFBOT_WIRE_PORT=seven" in capsys.readouterr().err


def test_the_graph_is_quoted_and_drawn_by_graphviz(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dot = to_dot({"nodes": ["/a"], "topics": [], "actions": [], "mismatches": ['<&> "b"', "c"]})
    assert '"/a" [label="/a"' in dot and '! <&> \\"b\\"\\n! c' in dot
    monkeypatch.setenv("PATH", str(tmp_path))
    out = tmp_path / "runs" / "graph.svg"
    assert f"`dot -Tsvg {out.with_suffix('.dot')} -o {out}`" in write_graph(out, dot)
    assert out.with_suffix(".dot").read_text() == dot and not out.exists()
    program = tmp_path / "dot"
    program.write_text('#!/bin/sh\n[ "$1" = -Tsvg ] && exec /bin/cat\necho "no format $1" >&2; exit 1\n')
    program.chmod(0o755)
    assert write_graph(out, dot) == str(out) and out.read_text() == dot
    with pytest.raises(ToolError, match="no format -Txyz"):
        write_graph(tmp_path / "graph.xyz", dot)


@given(st.lists(st.floats(1e-4, 10.0), min_size=1, max_size=30))
def test_rates_are_those_of_the_intervals(gaps: list[float]) -> None:
    times = np.cumsum([0.0, *gaps])
    meter = Meter()
    for at in times:
        meter.add(float(at), 4)
    rate = meter.rate()
    assert rate.messages == len(times)
    assert rate.hz == pytest.approx(len(gaps) / sum(gaps))
    assert rate.min_interval == pytest.approx(min(gaps), rel=1e-3) and rate.longest == pytest.approx(
        max(gaps), rel=1e-3
    )
    assert rate.bytes_per_second == pytest.approx(4 * rate.hz)
    assert rate.deviation == pytest.approx(float(np.std(gaps)), rel=1e-3, abs=1e-6)
    assert "Hz" in rate_line("/x", rate) and "no message" in rate_line("/x", Meter().rate())
