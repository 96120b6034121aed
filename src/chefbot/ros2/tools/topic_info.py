"""`chefbot topic list` and `info`: who speaks and who listens, and who of them cannot hear whom."""

from __future__ import annotations

from chefbot.ros2.rmw.graph import Endpoint, Graph, Named
from chefbot.ros2.rmw.qos import BEST_EFFORT, KEEP_ALL, RELIABILITY_BEST_AVAILABLE, QoS, Span, is_unlimited
from chefbot.ros2.rmw.qos_matching import types_said
from chefbot.ros2.tools.common import columns, console, find, hidden, mismatches, on_wire, type_text


def run_list(verbose: bool, everything: bool) -> None:
    """A name a line; with types and numbers of ends if `verbose`."""
    with on_wire("topic") as node:
        for line in list_lines(node.wire.graph, verbose, everything):
            console.print(line)


def run_info(name: str) -> None:
    """Ends of one topic with QoS."""
    with on_wire("topic") as node:
        named = find(node.wire.graph.topics, name, "topic")
        for line in info_lines(node.wire.graph, named):
            console.print(line)


def list_lines(graph: Graph, verbose: bool, everything: bool) -> list[str]:
    """What `topic list` prints."""
    topics = [one for one in graph.topics().values() if everything or not hidden(one.name)]
    if not verbose:
        return [one.name for one in topics]
    rows = [["topic", "type", "publishers", "subscriptions"]]
    for one in topics:
        types = ", ".join(dict.fromkeys(kind.name for kind in types_said(one)))
        rows.append([one.name, types, str(len(seen(one.givers))), str(len(seen(one.takers)))])
    return [*columns(rows), *(f"! {one}" for one in mismatches(graph))]


def info_lines(graph: Graph, named: Named) -> list[str]:
    """What `topic info` prints."""
    lines = [named.name, *(f"type: {type_text(kind)}" for kind in named.types)]
    for title, ends in (("published by", named.givers), ("heard by", named.takers)):
        lines.append(f"{title}:" if seen(ends) else f"{title}: nobody")
        lines += [f"  {row}" for row in columns(_row(one, named) for one in seen(ends))]
    return [*lines, *(f"! {one}" for one in mismatches(graph, named.name))]


def seen(ends: tuple[Endpoint, ...]) -> tuple[Endpoint, ...]:
    """Without those of tools."""
    return tuple(one for one in ends if not hidden(one.node.full_name))


def qos_words(qos: QoS) -> str:
    """'reliable, volatile, keep last 10'"""
    words = [
        {BEST_EFFORT: "best effort", RELIABILITY_BEST_AVAILABLE: "best available"}.get(
            qos.reliability, "reliable"
        ),
        "transient local" if qos.latched else "volatile",
        "keep all" if qos.history == KEEP_ALL else f"keep last {qos.depth}",
    ]
    for name, span in (("deadline", qos.deadline), ("lifespan", qos.lifespan), ("lease", qos.lease)):
        if not is_unlimited(span):
            words.append(f"{name} {_seconds(span):g} s")
    return ", ".join(words)


def _row(one: Endpoint, named: Named) -> list[str]:
    kind = [type_text(one.end.type)] if len(named.types) > 1 else []
    return [one.node.full_name, qos_words(one.end.qos), *kind]


def _seconds(span: Span) -> float:
    return span.sec + span.nanosec * 1e-9
