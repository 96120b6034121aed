"""Inspects the graph for a page, while somebody looks: nodes and topics, newest messages, parameters and the log."""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

from chefbot.ros2.rmw.environment import domain_from_environment, port_from_environment
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.graph import EndpointGroup, Graph
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.tools.common import is_hidden, mismatches
from chefbot.ros2.tools.inspection_views import (
    GraphSummary,
    LogLine,
    NodeParameters,
    TopicSummary,
    TopicValue,
)
from chefbot.ros2.tools.leases import Leases
from chefbot.ros2.tools.remote_parameters import parameter_owners
from chefbot.ros2.tools.sampled_rates import SampledRates
from chefbot.ros2.tools.topic_info import without_tools
from chefbot.ros2.tools.watched_log import WatchedLog
from chefbot.ros2.tools.watched_parameters import ParameterChange, WatchedParameters
from chefbot.ros2.tools.watched_topic import WatchedTopic

MAX_TOPICS, MAX_NODES = 12, 4
"""Maximum numbers of topics, and of nodes with parameters, that are watched at once, by all pages together."""
PERIOD, SLOW_PERIODS = 0.2, 5
"""Period at which values are shown, s; graph, parameters and log are shown every so many of these periods."""
SEARCH = 2.0
"""Time after which a network that was not found counts as none, s."""
NO_GRAPH = "There is no ROS network here; the launch may run with wire:=off"
WHOLE = "graph"
"""Name under which the graph itself is requested."""


class Display(NamedTuple):
    """Where an inspector shows what it finds; called in its thread."""

    graph: Callable[[GraphSummary], None]
    values: Callable[[tuple[TopicValue, ...]], None]
    parameters: Callable[[tuple[NodeParameters, ...]], None]
    log: Callable[[tuple[LogLine, ...]], None]


class Watch(NamedTuple):
    """What a page looks at beside the graph and the log: topics, and nodes whose parameters it shows."""

    topics: tuple[str, ...] = ()
    nodes: tuple[str, ...] = ()


class Inspector:
    """Shows the graph and what is watched, from a thread that runs while it is requested again and again."""

    def __init__(self, display: Display) -> None:
        self._display = display
        self._graph = Leases(1)
        self._topics = Leases(
            MAX_TOPICS, f"At most {MAX_TOPICS} topics can be watched at once, by all pages together"
        )
        self._nodes = Leases(
            MAX_NODES,
            f"The parameters of at most {MAX_NODES} nodes can be shown at once, by all pages together",
        )
        self._changes: queue.SimpleQueue[ParameterChange] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()
        self._begin = time.monotonic()

    def watch(self, watch: Watch) -> None:
        """Show the graph and this for a while; repeat it to continue. Thread-safe, and returns at once.

        Raises ToolError for too many topics or nodes.
        """
        self._topics.renew(watch.topics)
        self._nodes.renew(watch.nodes)
        self._graph.renew((WHOLE,))
        with self._lock:
            if self._thread is None and not self._closing.is_set():
                self._thread = threading.Thread(target=self._run, name="inspector", daemon=True)
                self._thread.start()

    def set_parameter(self, change: ParameterChange) -> None:
        """Set a parameter of a node, whose parameters are shown with the outcome. Thread-safe.

        Raises ToolError for too many nodes.
        """
        self.watch(Watch(nodes=(change.node,)))
        self._changes.put(change)

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
            self._display.graph(GraphSummary(problem=str(error)))
        finally:
            with self._lock:
                self._thread = None

    def _inspect(self, node: RmwNode) -> None:
        watched, parameters, log = WatchedTopics(node, self._begin), WatchedParameters(node), WatchedLog(node)
        sampled = SampledRates(node)
        begin, step = time.monotonic(), 0
        try:
            while not self._closing.wait(PERIOD) and self._graph.names():
                found = node.wire.connected or time.monotonic() - begin > SEARCH
                self._set_parameters(parameters)
                sampled.update(published_topics(node.wire.graph))
                if found and step % SLOW_PERIODS == 0:
                    connected = node.wire.connected
                    self._display.graph(summary(node.wire.graph, sampled.rates, connected=connected))
                    self._display.parameters(parameters.read(self._nodes.names()))
                    self._display.log(log.lines())
                step += 1
                self._display.values(watched.values(self._topics.names()))
        finally:
            sampled.close()
            parameters.close()
            self._display.values(())
            self._display.parameters(())

    def _set_parameters(self, parameters: WatchedParameters) -> None:
        while not self._changes.empty():
            parameters.set(self._changes.get())


class WatchedTopics:
    """The topics that are watched now, by name."""

    def __init__(self, node: RmwNode, begin: float) -> None:
        self._node, self._begin = node, begin
        self._topics: dict[str, WatchedTopic] = {}

    def values(self, names: list[str]) -> tuple[TopicValue, ...]:
        """Return the values of these topics, and watch no others."""
        for name in set(self._topics) - set(names):
            self._topics.pop(name).close()
        for name in names:
            if name not in self._topics:
                self._topics[name] = WatchedTopic(self._node, name, self._begin)
        groups = self._node.wire.graph.topics() if self._topics else {}
        return tuple(topic.value(groups.get(name)) for name, topic in self._topics.items())


def published_topics(graph: Graph) -> dict[str, EndpointGroup]:
    """Return the topics with publishers, without hidden ones."""
    topics = graph.topics()
    return {name: topic for name, topic in topics.items() if topic.providers and not is_hidden(name)}


def summary(graph: Graph, rates: Mapping[str, float], *, connected: bool) -> GraphSummary:
    """Return the graph without tools and hidden names; rates: of the topics that were measured, Hz."""
    nodes = sorted({node.full_name for node in graph.nodes() if not is_hidden(node.full_name)})
    if not connected and not nodes:
        return GraphSummary(problem=NO_GRAPH)
    topics = tuple(
        _summary(topic, rates.get(topic.name))
        for topic in graph.topics().values()
        if not is_hidden(topic.name)
    )
    owners = tuple(parameter_owners(graph))
    return GraphSummary(tuple(nodes), topics, tuple(mismatches(graph)), parameter_nodes=owners)


def _summary(topic: EndpointGroup, hz: float | None) -> TopicSummary:
    publishers, subscriptions = (
        tuple(sorted({endpoint.node.full_name for endpoint in without_tools(endpoints)}))
        for endpoints in (topic.providers, topic.consumers)
    )
    kinds = tuple(dict.fromkeys(kind.name for kind in topic.types))
    return TopicSummary(topic.name, kinds, publishers, subscriptions, None if hz is None else round(hz, 1))
