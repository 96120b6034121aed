"""Tests of the inspector of a page: the graph, rates and values of watched topics, and its end."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Annotated, Any

import msgspec
import numpy as np
import pytest
from tests.support.waiting import wait_for

from chefbot.bridge.parameters import ParameterServices
from chefbot.msgs import std_msgs as module_messages
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.message import Float64, Message
from chefbot.msgs.rcl_interfaces import Log
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import ROSOUT, TRANSIENT_LOCAL, QoS
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.tools import inspector as module
from chefbot.ros2.tools import leases
from chefbot.ros2.tools.common import ToolError
from chefbot.ros2.tools.inspection_views import (
    GraphSummary,
    LogLine,
    NodeParameters,
    TopicSummary,
    TopicValue,
)
from chefbot.ros2.tools.inspector import MAX_NODES, MAX_TOPICS, NO_GRAPH, Display, Inspector, Watch
from chefbot.ros2.tools.watched_log import KEPT_LINES, MAX_LENGTH
from chefbot.ros2.tools.watched_parameters import MAX_BOUND, ParameterChange
from chefbot.ros2.tools.watched_topic import SHOWN_ELEMENTS

Other = msgspec.defstruct(
    "Other", [("size", Float64, 0.0)], bases=(Message,), module="their_msgs", frozen=True, eq=False
)
"""A type that chefbot has no definition of."""


class Looking:
    """An inspector and what it has shown last."""

    def __init__(self) -> None:
        self.graph = GraphSummary()
        self.values: dict[str, TopicValue] = {}
        self.parameters: dict[str, NodeParameters] = {}
        self.log: tuple[LogLine, ...] = ()
        self.inspector = Inspector(
            Display(self._show_graph, self._show_values, self._show_parameters, self._show_log)
        )

    def _show_graph(self, graph: GraphSummary) -> None:
        self.graph = graph

    def _show_values(self, values: tuple[TopicValue, ...]) -> None:
        self.values = {value.name: value for value in values}

    def _show_parameters(self, nodes: tuple[NodeParameters, ...]) -> None:
        self.parameters = {node.node: node for node in nodes}

    def _show_log(self, lines: tuple[LogLine, ...]) -> None:
        self.log = lines

    def value_of(self, node: str, name: str) -> Any:
        """The shown value of a parameter, None if it is not shown."""
        shown = self.parameters.get(node, NodeParameters(node)).parameters
        return next((one.value for one in shown if one.name == name), None)

    def until(self, *topics: str, condition: Any, nodes: tuple[str, ...] = ()) -> None:
        """Watch topics as a page does until the condition holds."""

        def met() -> bool:
            self.inspector.watch(Watch(topics, nodes))
            return bool(condition())

        wait_for(met)


@pytest.fixture
def looking(wire: RmwContext, monkeypatch: pytest.MonkeyPatch) -> Iterator[Looking]:
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", str(wire._port))
    monkeypatch.setenv("ROS_DOMAIN_ID", str(wire.domain))
    one = Looking()
    yield one
    one.inspector.close()


@pytest.fixture
def base(wire: RmwContext) -> Iterator[RmwNode]:
    """A node that publishes a scan and a message of an unknown type 50 times a second."""
    stop = threading.Event()
    with RmwNode(wire, "base", "/r") as node:
        scan, other, text = (
            node.publisher("scan", LaserScan),
            node.publisher("other", Other),
            node.publisher("text", String),
        )

        def publish() -> None:
            while not stop.wait(0.02):
                scan.publish(LaserScan(Header(frame_id="laser"), ranges=np.arange(640, dtype=np.float32)))
                other.publish(Other(2.5))
                text.publish(String("x" * 10_000))

        thread = threading.Thread(target=publish)
        thread.start()
        yield node
        stop.set()
        thread.join()


def test_the_graph_is_shown_without_the_inspector(looking: Looking, base: RmwNode) -> None:
    looking.until(condition=lambda: any(topic.name == "/r/scan" for topic in looking.graph.topics))
    assert looking.graph.nodes == ("/r/base",) and looking.graph.problem == ""
    scan = next(topic for topic in looking.graph.topics if topic.name == "/r/scan")
    assert msgspec.structs.replace(scan, hz=None) == TopicSummary(
        "/r/scan", ("sensor_msgs/msg/LaserScan",), ("/r/base",), ()
    )


@pytest.mark.slow
def test_rates_of_topics_that_nobody_watches_are_measured(looking: Looking, base: RmwNode) -> None:
    """Three are measured at a time; `rare` has messages that are stored for late-joining subscribers."""
    rare = base.publisher("rare", String, QoS(durability=TRANSIENT_LOCAL, depth=20))
    for number in range(20):
        rare.publish(String(str(number)))
    often = ["/r/scan", "/r/other", "/r/text"]

    def rates() -> dict[str, float]:
        return {topic.name: topic.hz for topic in looking.graph.topics if topic.hz is not None}

    looking.until(condition=lambda: {*often, "/r/rare"} <= set(rates()))
    assert rates()["/r/rare"] == 0.0
    assert min(rates()[name] for name in often) > 1.0
    assert looking.values == {}


@pytest.mark.slow
def test_a_watched_topic_has_its_newest_message_and_rate(looking: Looking, base: RmwNode) -> None:
    def seen() -> bool:
        value = looking.values.get("/r/scan")
        return value is not None and value.hz > 1.0 and value.messages > 1 and value.value is not None

    looking.until("/r/scan", condition=seen)
    scan = looking.values["/r/scan"]
    assert scan.value["header"]["frame_id"] == "laser"
    assert scan.value["ranges"][-1] == f"... {640 - SHOWN_ELEMENTS} more"
    assert scan.bytes_per_second > 2560 * scan.hz * 0.8 and scan.messages > 1 and scan.problem == ""
    looking.until(condition=lambda: "/r/scan" in looking.values)
    first = looking.values["/r/scan"].time
    looking.until("/r/scan", condition=lambda: looking.values["/r/scan"].time > first)


@pytest.mark.parametrize(
    ("topic", "problem"),
    [
        ("/r/other", "their_msgs/msg/Other"),
        ("/r/text", "too long to be shown"),
        ("/r/none", "No node publishes it"),
    ],
)
def test_what_cannot_be_shown_has_a_sentence(
    looking: Looking, base: RmwNode, topic: str, problem: str
) -> None:
    looking.until(topic, condition=lambda: problem in looking.values.get(topic, TopicValue(topic)).problem)
    assert looking.values[topic].value is None


@pytest.mark.slow
def test_a_publisher_that_ends_is_noticed_and_numbers_stay_plain(looking: Looking, wire: RmwContext) -> None:
    with RmwNode(wire, "base", "/r") as node:
        publisher = node.publisher("number", module_messages.Float64)

        def seen() -> bool:
            publisher.publish(module_messages.Float64(float("nan")))
            value = looking.values.get("/r/number")
            return value is not None and value.value == {"data": "nan"} and value.hz > 0.0

        looking.until("/r/number", condition=seen)
        assert looking.values["/r/number"].hz < 1000.0, "over the time of watching, not between two messages"
    looking.until("/r/number", condition=lambda: "No node" in looking.values["/r/number"].problem)
    assert looking.values["/r/number"].value == {"data": "nan"}


def test_too_many_topics_are_refused(looking: Looking) -> None:
    looking.inspector.watch(Watch(tuple(f"/a{number}" for number in range(MAX_TOPICS))))
    with pytest.raises(ToolError, match="At most 12 topics"):
        looking.inspector.watch(Watch(("/one_more",)))
    looking.inspector.watch(Watch(nodes=tuple(f"/a{number}" for number in range(MAX_NODES))))
    with pytest.raises(ToolError, match="parameters of at most 4 nodes"):
        looking.inspector.set_parameter(ParameterChange("/one_more", "x", 1))


@pytest.mark.slow
def test_it_ends_when_nobody_looks(looking: Looking, base: RmwNode, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leases, "LEASE", 0.5)
    looking.inspector.watch(Watch(("/r/scan",)))
    wait_for(lambda: looking.inspector._thread is None)
    looking.until("/r/scan", condition=lambda: "/r/scan" in looking.values)  # and begins again


def test_a_computer_without_a_network_is_named(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", str(port))
    monkeypatch.setattr(module, "SEARCH", 0.1)
    alone = Looking()
    alone.until(condition=lambda: alone.graph.problem == NO_GRAPH)
    alone.inspector.close()


class Settings(msgspec.Struct, frozen=True):
    """Parameters of a node, as a page shows them."""

    speed: Annotated[
        float, msgspec.Meta(ge=0.0, le=1.0, description="maximum speed", extra={"unit": "m/s"})
    ] = 0.3
    count: Annotated[int, msgspec.Meta(ge=1)] = 5
    name: str = "x"
    weights: tuple[float, ...] = (1.0, 2.0)


@pytest.fixture
def owner(wire: RmwContext) -> Iterator[list[Settings]]:
    """A node with parameters, of which only `speed` can be set, and not to 0.9; and its present settings."""
    present = [Settings()]

    def set_values(values: dict[str, Any], done: Any) -> None:
        reason = "it is too fast here" if values.get("speed") == 0.9 else ""
        if not reason:
            present.append(msgspec.structs.replace(present[-1], **values))
        done(reason)

    with RmwNode(wire, "limits", "/r") as node:
        ParameterServices(node, lambda: present[-1], set_values, live=("speed",), simulated=False)
        yield present


@pytest.mark.slow
def test_parameters_are_shown_with_their_bounds(looking: Looking, owner: list[Settings]) -> None:
    looking.until(
        nodes=("/r/limits",), condition=lambda: looking.value_of("/r/limits", "weights") == [1.0, 2.0]
    )
    shown = {one.name: one for one in looking.parameters["/r/limits"].parameters}
    speed, count, name = shown["speed"], shown["count"], shown["name"]
    assert (speed.value, speed.type, speed.low, speed.high) == (0.3, "double", 0.0, 1.0)
    assert speed.description == "maximum speed, m/s" and not speed.read_only
    assert (count.value, count.low, count.high, count.read_only) == (5, 1, None, True)
    assert (name.value, name.type, name.low) == ("x", "string", None)
    assert all(one.high is None or one.high < MAX_BOUND for one in shown.values())
    looking.until(condition=lambda: looking.graph.parameter_nodes == ("/r/limits",))


@pytest.mark.parametrize(
    ("name", "value", "outcome", "speed"),
    [
        ("speed", 0.5, "Parameter speed is now 0.5", 0.5),
        ("speed", 1, "Parameter speed is now 1.0", 1.0),
        ("speed", 0.9, "Node /r/limits refuses it: it is too fast here", 0.3),
        ("speed", "fast", "speed is of type double, which fast is not", 0.3),
        ("sped", 0.5, "no parameter 'sped'", 0.3),
    ],
)
@pytest.mark.slow
def test_a_parameter_is_set_or_refused_with_a_reason(
    looking: Looking, owner: list[Settings], name: str, value: Any, outcome: str, speed: float
) -> None:
    refusals: list[str] = []
    looking.inspector.set_parameter(ParameterChange("/r/limits", name, value, refusals.append))

    def ended() -> bool:
        return outcome in looking.parameters.get("/r/limits", NodeParameters("")).outcome

    looking.until(nodes=("/r/limits",), condition=ended)
    looking.until(nodes=("/r/limits",), condition=lambda: looking.value_of("/r/limits", "speed") == speed)
    assert owner[-1].speed == speed
    assert [outcome in refusal for refusal in refusals] == [True] * ("is now" not in outcome)


@pytest.mark.slow
def test_a_node_without_parameters_has_a_sentence(looking: Looking, base: RmwNode) -> None:
    def named() -> bool:
        return "/r/base" in looking.parameters and bool(looking.parameters["/r/base"].problem)

    looking.until(nodes=("/r/base",), condition=named)
    assert looking.parameters["/r/base"].problem.startswith("Node /r/base does not answer")


def test_the_log_keeps_the_newest_messages(looking: Looking, wire: RmwContext) -> None:
    with RmwNode(wire, "talker", "/r") as node:
        publisher = node.publisher("/rosout", Log, ROSOUT)
        for number in range(KEPT_LINES + 5):
            publisher.publish(Log(Time.of(number * 10**9), 30, "r.talker", f"line {number}"))

        def logged() -> bool:
            publisher.publish(Log(Time.of(7 * 10**9), 40, "r.talker", "x" * (MAX_LENGTH + 1)))
            return bool(looking.log) and looking.log[-1].level == 40

        looking.until(condition=logged)
    assert len(looking.log) <= KEPT_LINES
    assert looking.log[-1].time == 7.0 and len(looking.log[-1].text) < MAX_LENGTH + 3
