"""The command `chefbot topic pub`: publish messages on a topic."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from chefbot.errors import name_hint
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.idl.yaml_conversion import message_from_dict
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import DEFAULT, TRANSIENT_LOCAL_QOS, QoS
from chefbot.ros2.tools.common import (
    ToolError,
    console,
    errors,
    full_name,
    graph_node,
    is_hidden,
    local_definition,
    mismatches,
    stop_event,
    type_and_values,
    type_name,
)
from chefbot.ros2.tools.remote_types import definition_of
from chefbot.ros2.tools.robot_clock import RobotClock
from chefbot.ros2.tools.topic_info import without_tools

MATCH_TIMEOUT = 2.0
"""Maximum time to match existing subscribers, s."""
LAST_WAIT = 0.1
"""Time for the last message to be sent, s."""


def run_pub(topic: str, arguments: Sequence[str], rate: float, once: bool) -> None:
    """Publish at `rate` Hz until Ctrl-C, or once.

    Times written as `now` are set for each message.
    """
    type_given, values = type_and_values(arguments)
    with graph_node("pub") as node, stop_event() as stop:
        name = full_name(topic)
        kind, wire_type = _message_type(node, name, type_given)
        make = _maker(kind, values, name, RobotClock(node, name))
        make()
        publisher = node.raw_publisher(name, wire_type, _publisher_qos(node.wire.graph, name))
        _await_subscribers(node.wire.graph, name, publisher)
        count, start = 0, time.monotonic()
        while not stop.is_set():
            publisher.publish(make())
            count += 1
            if once or stop.wait(max(0.0, start + count / rate - time.monotonic())):
                break
        time.sleep(LAST_WAIT)
        console.print(f"published {count} on {name}")


def _maker(kind: type[Message], plain: object, name: str, clock: RobotClock) -> Callable[[], Message]:
    return lambda: message_from_dict(kind, plain, f"values for {name}", clock.now())


def _message_type(node: RmwNode, name: str, type_given: str) -> tuple[type[Message], InterfaceType]:
    """Return the message class and type: as given, else the type that the topic has already."""
    named = node.wire.graph.topics().get(name)
    endpoints = without_tools((*named.consumers, *named.providers)) if named else ()
    if type_given:
        full = type_name(type_given, "msg")
        existing = next(
            (endpoint.info.type for endpoint in endpoints if endpoint.info.type.name == full), None
        )
        kind = definition_of(node, existing, name) if existing else _local_definition(full)
        return kind, existing or InterfaceType.of(kind)
    if not endpoints:
        others = name_hint(name, (topic for topic in node.wire.graph.topics() if not is_hidden(topic)))
        raise ToolError(
            f"{name} is not in the ROS graph yet, so its type must be given before the values{others}"
        )
    wire_type = endpoints[0].info.type
    return definition_of(node, wire_type, f"topic {name}"), wire_type


def _local_definition(name: str) -> type[Message]:
    try:
        return local_definition(InterfaceType.of(message_type(name)), message_type, name)
    except KeyError:
        raise ToolError(
            f"there is no definition of {name!r} here; write it as geometry_msgs/msg/Twist"
        ) from None


def _publisher_qos(graph: Graph, name: str) -> QoS:
    """Return latched QoS if a subscription requests it, else the default."""
    named = graph.topics().get(name)
    subscriptions = without_tools(named.consumers) if named else ()
    return TRANSIENT_LOCAL_QOS if any(one.info.qos.latched for one in subscriptions) else DEFAULT


def _await_subscribers(graph: Graph, name: str, publisher: Publisher[Message]) -> None:
    named = graph.topics().get(name)
    if named is None or not without_tools(named.consumers):
        errors.print(f"chefbot: there is no subscriber to {name}")
        return
    deadline = time.monotonic() + MATCH_TIMEOUT
    while time.monotonic() < deadline and not publisher.has_subscribers:
        time.sleep(0.01)
    time.sleep(0.0 if publisher.has_subscribers and not publisher.qos.latched else LAST_WAIT)
    for sentence in mismatches(graph, name):
        errors.print(f"chefbot: {sentence}")
