"""The commands `chefbot node list` and `info`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from chefbot.ros2.rmw.graph import Endpoint, Graph
from chefbot.ros2.rmw.liveliness import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION
from chefbot.ros2.tools.common import columns, console, errors, find, graph_node, is_hidden

TITLES = {
    PUBLISHER: "publishes",
    SUBSCRIPTION: "subscribes to",
    SERVER: "serves",
    CLIENT: "calls",
}
_ACTION = "/_action/"


def run_list(include_hidden: bool) -> None:
    """Print one node name per line."""
    with graph_node("node") as node:
        names = [
            found.full_name
            for found in node.wire.graph.nodes()
            if include_hidden or not is_hidden(found.full_name)
        ]
        for name in sorted(set(names)):
            console.print(name)
            if names.count(name) > 1:
                errors.print(
                    f"chefbot: {names.count(name)} nodes are called {name}; ROS 2 wants each name once"
                )


def run_info(name: str) -> None:
    """Print the topics, services and actions of a node."""
    with graph_node("node") as node:
        graph = node.wire.graph
        found = find(lambda: {entry.full_name: entry for entry in graph.nodes()}, name, "node")
        for line in info_lines(graph, found.full_name):
            console.print(line)


def info_lines(graph: Graph, name: str) -> list[str]:
    """Return the lines that `node info` prints."""
    endpoints = graph.endpoints_of(name)
    lines = [name]
    for kind, title in TITLES.items():
        rows = [
            [endpoint.info.topic, endpoint.info.type.name]
            for endpoint in endpoints
            if endpoint.info.kind == kind and not _is_action_internal(endpoint)
        ]
        lines += _section(f"{title}:", rows)
    for kind, title in ((SERVER, "serves actions:"), (CLIENT, "calls actions:")):
        lines += _section(title, list(_actions(endpoints, kind)))
    return lines


def _section(title: str, rows: list[list[str]]) -> list[str]:
    """Return the lines of a section; endpoints in several versions of a type are listed once."""
    return [title, *(f"  {line}" for line in dict.fromkeys(columns(rows)))] if rows else []


def _is_action_internal(endpoint: Endpoint) -> bool:
    return _ACTION in endpoint.info.topic


def _actions(endpoints: Iterable[Endpoint], kind: str) -> Iterator[list[str]]:
    for endpoint in endpoints:
        name, separator, part = endpoint.info.topic.partition(_ACTION)
        if endpoint.info.kind == kind and separator and part == "send_goal":
            yield [name, endpoint.info.type.name.removesuffix("_SendGoal")]
