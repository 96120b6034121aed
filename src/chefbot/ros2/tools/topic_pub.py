"""`chefbot topic pub`: say something on a topic."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from chefbot.errors import UserError, nearest
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.idl.yaml_conversion import from_plain
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import DEFAULT, LATCHED, QoS
from chefbot.ros2.tools.common import (
    console,
    definition,
    errors,
    full_name,
    hidden,
    mismatches,
    on_wire,
    stopping,
    type_and_values,
    type_name,
)
from chefbot.ros2.tools.remote_types import definition_of
from chefbot.ros2.tools.topic_info import seen

LISTENER_WAIT = 2.0
"""Seconds that those who listen already have to be found."""
LAST_WAIT = 0.1
"""Seconds that the last message has to get away."""


def run_pub(topic: str, words: Sequence[str], rate: float, once: bool) -> None:
    """`rate` times a second until Ctrl-C, or once. Times written as `now` are those of each message."""
    given, plain = type_and_values(words)
    with on_wire("pub") as node, stopping() as stop:
        name = full_name(topic)
        kind, wire_type = _type(node, name, given)
        make = _maker(kind, plain, name)
        make()
        publisher = node.raw_publisher(name, wire_type, _offer(node.wire.graph, name))
        _await_listeners(node.wire.graph, name, publisher)
        count, began = 0, time.monotonic()
        while not stop.is_set():
            publisher.publish(make())
            count += 1
            if once or stop.wait(max(0.0, began + count / rate - time.monotonic())):
                break
        time.sleep(LAST_WAIT)
        console.print(f"published {count} on {name}")


def _maker(kind: type[Message], plain: object, name: str) -> Callable[[], Message]:
    return lambda: from_plain(kind, plain, f"values for {name}", Time.of(time.time_ns()))


def _type(node: WireNode, name: str, given: str) -> tuple[type[Message], WireType]:
    """As given, else as the topic has it already."""
    named = node.wire.graph.topics().get(name)
    ends = [one for one in (*named.takers, *named.givers) if seen((one,))] if named else []
    if given:
        full = type_name(given, "msg")
        there = next((one.end.type for one in ends if one.end.type.name == full), None)
        kind = definition_of(node, there, name) if there else _ours(full)
        return kind, there or WireType.of(kind)
    if not ends:
        others = nearest(name, (one for one in node.wire.graph.topics() if not hidden(one)))
        raise UserError(f"nobody has {name} yet, so its type must be written before the values{others}")
    wire_type = ends[0].end.type
    return definition_of(node, wire_type, f"topic {name}"), wire_type


def _ours(name: str) -> type[Message]:
    try:
        return definition(WireType.of(message_type(name)), message_type, name)
    except KeyError:
        raise UserError(
            f"there is no definition of {name!r} here; write it as geometry_msgs/msg/Twist"
        ) from None


def _offer(graph: Graph, name: str) -> QoS:
    """Latched where somebody asks for it."""
    named = graph.topics().get(name)
    return LATCHED if named and any(one.end.qos.latched for one in seen(named.takers)) else DEFAULT


def _await_listeners(graph: Graph, name: str, publisher: Publisher[Message]) -> None:
    named = graph.topics().get(name)
    if named is None or not seen(named.takers):
        errors.print(f"chefbot: nobody listens to {name}")
        return
    until = time.monotonic() + LISTENER_WAIT
    while time.monotonic() < until and not publisher.heard:
        time.sleep(0.01)
    time.sleep(0.0 if publisher.heard and not publisher.qos.latched else LAST_WAIT)
    for sentence in mismatches(graph, name):
        errors.print(f"chefbot: {sentence}")
