"""The page of the nodes of behavior trees: a table for each kind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

from chefbot.behavior_tree.blackboard import NodePort
from chefbot.behavior_tree.catalog import CONTROL_NODES, NodeKind, NodeType
from chefbot.behavior_tree.navigation_nodes import navigation_nodes
from generate.rst import anchor, code, escape, heading, table, write

TITLES = {
    NodeKind.CONTROL: "Control nodes",
    NodeKind.DECORATOR: "Decorators",
    NodeKind.ACTION: "Actions",
    NodeKind.CONDITION: "Conditions",
}
HEADER = ("node", "what it does", "port", "value", "default")


def write_behavior_trees(path: Path) -> None:
    """Write the page from the catalog of nodes."""
    catalog = {**CONTROL_NODES, **navigation_nodes(cast(Any, None))}
    parts = [anchor("behavior-tree-nodes"), heading("Behavior tree nodes"), "See :doc:`/behavior_trees`.\n"]
    for kind, title in TITLES.items():
        rows = [row for name, one in catalog.items() if one.kind is kind for row in _rows(name, one)]
        parts += [heading(title, "-"), table(HEADER, rows)]
    write(path, parts)


def _rows(name: str, one: NodeType) -> Iterator[tuple[str, ...]]:
    for index, port in enumerate(one.ports or (None,)):
        start = (code(name), escape(one.description)) if index == 0 else ("", "")
        yield *start, *(_cells(port) if port is not None else ("", "", ""))


def _cells(port: NodePort) -> tuple[str, str, str]:
    kind = "blackboard key" if port.kind is object else port.kind.__name__
    default = "required" if port.default is None else code(port.default)
    return code(port.name), f"{kind}, output" if port.direction == "output" else kind, default
