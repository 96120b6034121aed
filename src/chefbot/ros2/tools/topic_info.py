"""The commands `chefbot topic list` and `info`: publishers, subscriptions, and QoS or type mismatches."""

from __future__ import annotations

from chefbot.ros2.rmw.graph import Endpoint, EndpointGroup, Graph
from chefbot.ros2.rmw.qos import (
    BEST_EFFORT,
    KEEP_ALL,
    RELIABILITY_BEST_AVAILABLE,
    QoS,
    QosDuration,
    is_unlimited,
)
from chefbot.ros2.rmw.qos_matching import offered_types
from chefbot.ros2.tools.common import columns, console, find, graph_node, is_hidden, mismatches, type_text


def run_list(verbose: bool, include_hidden: bool) -> None:
    """Print one topic name per line; with types and numbers of endpoints if `verbose`."""
    with graph_node("topic") as node:
        for line in list_lines(node.wire.graph, verbose, include_hidden):
            console.print(line)


def run_info(name: str) -> None:
    """Print the endpoints of one topic with their QoS."""
    with graph_node("topic") as node:
        named = find(node.wire.graph.topics, name, "topic")
        for line in info_lines(node.wire.graph, named):
            console.print(line)


def list_lines(graph: Graph, verbose: bool, include_hidden: bool) -> list[str]:
    """Return the lines that `topic list` prints."""
    topics = [topic for topic in graph.topics().values() if include_hidden or not is_hidden(topic.name)]
    if not verbose:
        return [topic.name for topic in topics]
    rows = [["topic", "type", "publishers", "subscriptions"]]
    for topic in topics:
        types = ", ".join(dict.fromkeys(kind.name for kind in offered_types(topic)))
        rows.append(
            [
                topic.name,
                types,
                str(len(without_tools(topic.providers))),
                str(len(without_tools(topic.consumers))),
            ]
        )
    return [*columns(rows), *(f"! {sentence}" for sentence in mismatches(graph))]


def info_lines(graph: Graph, named: EndpointGroup) -> list[str]:
    """Return the lines that `topic info` prints."""
    lines = [named.name, *(f"type: {type_text(kind)}" for kind in named.types)]
    for title, endpoints in (("published by", named.providers), ("subscribed to by", named.consumers)):
        lines.append(f"{title}:" if without_tools(endpoints) else f"{title}: none")
        lines += [
            f"  {row}" for row in columns(_row(endpoint, named) for endpoint in without_tools(endpoints))
        ]
    return [*lines, *(f"! {sentence}" for sentence in mismatches(graph, named.name))]


def without_tools(endpoints: tuple[Endpoint, ...]) -> tuple[Endpoint, ...]:
    """Return the endpoints without those of tools."""
    return tuple(endpoint for endpoint in endpoints if not is_hidden(endpoint.node.full_name))


def qos_text(qos: QoS) -> str:
    """Return readable QoS such as 'reliable, volatile, keep last 10'."""
    parts = [
        {BEST_EFFORT: "best effort", RELIABILITY_BEST_AVAILABLE: "best available"}.get(
            qos.reliability, "reliable"
        ),
        "transient local" if qos.latched else "volatile",
        "keep all" if qos.history == KEEP_ALL else f"keep last {qos.depth}",
    ]
    for name, span in (("deadline", qos.deadline), ("lifespan", qos.lifespan), ("lease", qos.lease)):
        if not is_unlimited(span):
            parts.append(f"{name} {_seconds(span):g} s")
    return ", ".join(parts)


def _row(endpoint: Endpoint, named: EndpointGroup) -> list[str]:
    kind = [type_text(endpoint.info.type)] if len(named.types) > 1 else []
    return [endpoint.node.full_name, qos_text(endpoint.info.qos), *kind]


def _seconds(span: QosDuration) -> float:
    return span.sec + span.nanosec * 1e-9
