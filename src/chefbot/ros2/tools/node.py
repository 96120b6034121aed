"""`chefbot node list` and `info`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from chefbot.ros2.rmw.graph import Endpoint, Graph
from chefbot.ros2.rmw.tokens import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION
from chefbot.ros2.tools.common import columns, console, errors, find, hidden, on_wire

TITLES = {
    PUBLISHER: "publishes",
    SUBSCRIPTION: "hears",
    SERVER: "serves",
    CLIENT: "calls",
}
_ACTION = "/_action/"


def run_list(everything: bool) -> None:
    """A name a line."""
    with on_wire("node") as node:
        names = [one.full_name for one in node.wire.graph.nodes() if everything or not hidden(one.full_name)]
        for name in sorted(set(names)):
            console.print(name)
            if names.count(name) > 1:
                errors.print(
                    f"chefbot: {names.count(name)} nodes are called {name}; ROS 2 wants each name once"
                )


def run_info(name: str) -> None:
    """What a node has."""
    with on_wire("node") as node:
        graph = node.wire.graph
        found = find(lambda: {one.full_name: one for one in graph.nodes()}, name, "node")
        for line in info_lines(graph, found.full_name):
            console.print(line)


def info_lines(graph: Graph, name: str) -> list[str]:
    """What `node info` prints."""
    ends = graph.ends_of(name)
    lines = [name]
    for kind, title in TITLES.items():
        rows = [
            [one.end.topic, one.end.type.name] for one in ends if one.end.kind == kind and not _inside(one)
        ]
        lines += _section(f"{title}:", rows)
    for kind, title in ((SERVER, "serves actions:"), (CLIENT, "calls actions:")):
        lines += _section(title, list(_actions(ends, kind)))
    return lines


def _section(title: str, rows: list[list[str]]) -> list[str]:
    """What is there in several editions of its type stands once."""
    return [title, *(f"  {line}" for line in dict.fromkeys(columns(rows)))] if rows else []


def _inside(one: Endpoint) -> bool:
    return _ACTION in one.end.topic


def _actions(ends: Iterable[Endpoint], kind: str) -> Iterator[list[str]]:
    for one in ends:
        name, inside, part = one.end.topic.partition(_ACTION)
        if one.end.kind == kind and inside and part == "send_goal":
            yield [name, one.end.type.name.removesuffix("_SendGoal")]
