"""Inspects the graph for a page: lists it, and follows the newest messages of a few topics while somebody watches."""

from __future__ import annotations

import math
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Collection
from typing import Any

import msgspec

from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.yaml_conversion import message_to_dict
from chefbot.ros2.rmw.environment import domain_from_environment, port_from_environment
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.graph import EndpointGroup, Graph
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.rmw.subscription import Subscription
from chefbot.ros2.tools.common import ToolError, is_hidden, mismatches
from chefbot.ros2.tools.inspection_views import GraphSummary, TopicSummary, TopicValue
from chefbot.ros2.tools.remote_types import definition_of
from chefbot.ros2.tools.subscribe import subscribe_any
from chefbot.ros2.tools.topic_info import without_tools

MAX_WATCHED = 12
"""Maximum number of topics that are watched at once, by all pages together."""
PERIOD = 0.2
"""Period at which values are shown, s; the graph is shown once a second."""
LEASE = 5.0
"""Time after the last request for which a topic is watched, s."""
SEARCH = 2.0
"""Time after which a network that was not found counts as none, s."""
WINDOW = 5.0
"""Time over which rates are measured, s."""
SHOWN_ELEMENTS, SHOWN_BYTES = 12, 6000
"""Maximum number of shown elements of an array, and maximum size of a value as JSON."""
NO_PUBLISHER = "Nobody publishes it now"
NO_GRAPH = "There is no ROS network here; the launch may run with wire:=off"

ShowGraph = Callable[[GraphSummary], None]
ShowValues = Callable[[tuple[TopicValue, ...]], None]


class Inspector:
    """Shows the graph by `show_graph` and watched topics by `show_values`, from a thread while it is used."""

    def __init__(self, show_graph: ShowGraph, show_values: ShowValues) -> None:
        self._show_graph, self._show_values = show_graph, show_values
        self._lock = threading.Lock()
        self._leases: dict[str, float] = {}
        self._until = 0.0
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()

    def watch(self, topics: Collection[str]) -> None:
        """Show the graph and these topics for a while; repeat it to go on. Thread-safe, and returns at once.

        Raises ToolError for too many topics.
        """
        until = time.monotonic() + LEASE
        with self._lock:
            leases = {name: end for name, end in self._leases.items() if end > time.monotonic()}
            leases |= dict.fromkeys(topics, until)
            if len(leases) > MAX_WATCHED:
                raise ToolError(f"At most {MAX_WATCHED} topics can be watched at once")
            self._leases, self._until = leases, until
            if self._thread is None and not self._closing.is_set():
                self._thread = threading.Thread(target=self._run, name="inspector", daemon=True)
                self._thread.start()

    def close(self) -> None:
        """End the inspection and wait for its thread."""
        self._closing.set()
        with self._lock:
            thread = self._thread
        if thread is not None:
            thread.join()

    def _run(self) -> None:
        try:
            domain, port = domain_from_environment(), port_from_environment()
            with (
                RmwContext(domain, port=port, router=False) as wire,
                RmwNode(wire, f"_chefbot_inspector_{os.getpid()}") as node,
            ):
                self._inspect(node)
        except RmwError as error:
            self._show_graph(GraphSummary(problem=str(error)))
        finally:
            with self._lock:
                self._thread = None

    def _inspect(self, node: RmwNode) -> None:
        watched: dict[str, WatchedTopic] = {}
        begin, step = time.monotonic(), 0
        while not self._closing.wait(PERIOD) and (names := self._names()) is not None:
            found = node.wire.connected or time.monotonic() - begin > SEARCH
            if found and step % round(1.0 / PERIOD) == 0:
                self._show_graph(summary(node.wire.graph, connected=node.wire.connected))
            step += 1
            for name in set(watched) - set(names):
                watched.pop(name).close()
            for name in names:
                if name not in watched:
                    watched[name] = WatchedTopic(node, name, begin)
            self._show_values(tuple(topic.value() for topic in watched.values()))

    def _names(self) -> list[str] | None:
        """Return the topics that are watched now, None if nobody looks any more."""
        now = time.monotonic()
        with self._lock:
            return (
                sorted(name for name, end in self._leases.items() if end > now) if self._until > now else None
            )


class WatchedTopic:
    """Keeps the newest sample of a topic; it is decoded only when it is shown."""

    def __init__(self, node: RmwNode, name: str, begin: float) -> None:
        self._node, self._name, self._begin = node, name, begin
        self._since = time.monotonic()
        self._newest: tuple[float, InterfaceType, bytes] | None = None
        self._arrivals: deque[tuple[float, int]] = deque()
        self._count = 0
        self._types: dict[InterfaceType, type[Message] | str] = {}
        self._subscriptions: list[Subscription] = []

    def value(self) -> TopicValue:
        """Return the newest message with the rate."""
        if not self._subscriptions:
            self._subscribe()
        hz, rate = self._rates()
        base = TopicValue(self._name, round(hz, 1), round(rate), self._count)
        newest = self._newest
        topic = self._node.wire.graph.topics().get(self._name)
        if topic is None or not topic.providers:
            base = msgspec.structs.replace(base, problem=NO_PUBLISHER)
        if newest is None:
            return base
        at, kind, data = newest
        return self._decoded(msgspec.structs.replace(base, time=round(at - self._begin, 3)), kind, data)

    def close(self) -> None:
        """End the subscriptions of this topic."""
        for subscription in self._subscriptions:
            self._node.destroy(subscription)

    def _subscribe(self) -> None:
        topic = self._node.wire.graph.topics().get(self._name)
        if topic is not None and topic.providers:
            self._subscriptions = subscribe_any(self._node, topic, self._receive)

    def _receive(self, kind: InterfaceType, data: bytes) -> None:
        """Keep a sample, in a thread of Zenoh; deques are safe from several threads."""
        now = time.monotonic()
        self._newest = (now, kind, data)
        self._arrivals.append((now, len(data)))
        self._count += 1

    def _rates(self) -> tuple[float, float]:
        """Return messages and bytes per second over the last seconds."""
        now = time.monotonic()
        while self._arrivals and self._arrivals[0][0] < now - WINDOW:
            self._arrivals.popleft()
        arrivals, span = list(self._arrivals), min(WINDOW, max(now - self._since, PERIOD))
        return len(arrivals) / span, sum(size for _, size in arrivals) / span

    def _decoded(self, view: TopicValue, kind: InterfaceType, data: bytes) -> TopicValue:
        known = self._definition(kind)
        if isinstance(known, str):
            return msgspec.structs.replace(view, problem=known)
        try:
            plain = _finite(message_to_dict(known.from_cdr(data), SHOWN_ELEMENTS))
        except CdrError as error:
            return msgspec.structs.replace(view, problem=f"It is not a valid {kind.name}: {error}")
        if len(msgspec.json.encode(plain)) > SHOWN_BYTES:
            return msgspec.structs.replace(view, problem="It is too long to be shown")
        return msgspec.structs.replace(view, value=plain)

    def _definition(self, kind: InterfaceType) -> type[Message] | str:
        """Return the class of a type, or why there is none; a type of a node's own is requested only once."""
        if kind not in self._types:
            try:
                self._types[kind] = definition_of(self._node, kind, f"topic {self._name}")
            except ToolError as error:
                self._types[kind] = str(error)
        return self._types[kind]


def _finite(value: Any) -> Any:
    """Return plain data in which numbers that JSON does not have are texts: nan, inf, -inf."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_finite(part) for part in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def summary(graph: Graph, *, connected: bool) -> GraphSummary:
    """Return the graph without tools and hidden names."""
    nodes = sorted({node.full_name for node in graph.nodes() if not is_hidden(node.full_name)})
    if not connected and not nodes:
        return GraphSummary(problem=NO_GRAPH)
    topics = tuple(_summary(topic) for topic in graph.topics().values() if not is_hidden(topic.name))
    return GraphSummary(tuple(nodes), topics, tuple(mismatches(graph)))


def _summary(topic: EndpointGroup) -> TopicSummary:
    publishers, subscriptions = (
        tuple(sorted({endpoint.node.full_name for endpoint in without_tools(endpoints)}))
        for endpoints in (topic.providers, topic.consumers)
    )
    return TopicSummary(
        topic.name, tuple(dict.fromkeys(kind.name for kind in topic.types)), publishers, subscriptions
    )
