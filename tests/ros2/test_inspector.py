"""Tests of the inspector of a page: the graph, rates and values of watched topics, and its end."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.waiting import wait_for

from chefbot.msgs import std_msgs as module_messages
from chefbot.msgs.idl.message import Float64, Message
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.tools import inspector as module
from chefbot.ros2.tools.common import ToolError
from chefbot.ros2.tools.inspection_views import GraphSummary, TopicSummary, TopicValue
from chefbot.ros2.tools.inspector import MAX_WATCHED, NO_GRAPH, SHOWN_ELEMENTS, Inspector

Other = msgspec.defstruct(
    "Other", [("size", Float64, 0.0)], bases=(Message,), module="their_msgs", frozen=True, eq=False
)
"""A type that chefbot has no definition of."""


class Looking:
    """An inspector and what it has shown last."""

    def __init__(self) -> None:
        self.graph = GraphSummary()
        self.values: dict[str, TopicValue] = {}
        self.inspector = Inspector(self._show_graph, self._show_values)

    def _show_graph(self, graph: GraphSummary) -> None:
        self.graph = graph

    def _show_values(self, values: tuple[TopicValue, ...]) -> None:
        self.values = {value.name: value for value in values}

    def until(self, *topics: str, condition: Any) -> None:
        """Watch topics as a page does until the condition holds."""

        def met() -> bool:
            self.inspector.watch(topics)
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
    assert scan == TopicSummary("/r/scan", ("sensor_msgs/msg/LaserScan",), ("/r/base",), ())


def test_a_watched_topic_has_its_newest_message_and_rate(looking: Looking, base: RmwNode) -> None:
    def seen() -> bool:
        value = looking.values.get("/r/scan")
        return value is not None and value.hz > 1.0 and value.value is not None

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
        ("/r/none", "Nobody publishes it"),
    ],
)
def test_what_cannot_be_shown_has_a_sentence(
    looking: Looking, base: RmwNode, topic: str, problem: str
) -> None:
    looking.until(topic, condition=lambda: problem in looking.values.get(topic, TopicValue(topic)).problem)
    assert looking.values[topic].value is None


def test_a_publisher_that_ends_is_noticed_and_numbers_stay_plain(looking: Looking, wire: RmwContext) -> None:
    with RmwNode(wire, "base", "/r") as node:
        publisher = node.publisher("number", module_messages.Float64)

        def seen() -> bool:
            publisher.publish(module_messages.Float64(float("nan")))
            value = looking.values.get("/r/number")
            return value is not None and value.value == {"data": "nan"} and value.hz > 0.0

        looking.until("/r/number", condition=seen)
        assert looking.values["/r/number"].hz < 1000.0, "over the time of watching, not between two messages"
    looking.until("/r/number", condition=lambda: "Nobody" in looking.values["/r/number"].problem)
    assert looking.values["/r/number"].value == {"data": "nan"}


def test_too_many_topics_are_refused(looking: Looking) -> None:
    looking.inspector.watch([f"/a{number}" for number in range(MAX_WATCHED)])
    with pytest.raises(ToolError, match="At most 12 topics"):
        looking.inspector.watch(["/one_more"])


def test_it_ends_when_nobody_looks(looking: Looking, base: RmwNode, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LEASE", 0.5)
    looking.inspector.watch(["/r/scan"])
    wait_for(lambda: looking.inspector._thread is None)
    looking.until("/r/scan", condition=lambda: "/r/scan" in looking.values)  # and begins again


def test_a_computer_without_a_network_is_named(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_WIRE_PORT", str(port))
    monkeypatch.setattr(module, "SEARCH", 0.1)
    alone = Looking()
    alone.until(condition=lambda: alone.graph.problem == NO_GRAPH)
    alone.inspector.close()
