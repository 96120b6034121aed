"""A handler `on_NAME` of a node belongs to an input or an action NAME: one without is never called."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterator

import chefbot.nodes
from chefbot.runtime.node import Node


def node_classes() -> Iterator[type[Node]]:
    """All classes of the nodes, base classes included."""
    for module in pkgutil.walk_packages(chefbot.nodes.__path__, "chefbot.nodes."):
        importlib.import_module(module.name)
    pending = [Node]
    while pending:
        kind = pending.pop()
        yield kind
        pending += kind.__subclasses__()


def test_each_handler_belongs_to_a_port() -> None:
    orphans = set()
    for kind in node_classes():
        declared = {name for base in kind.__mro__ for name in inspect.get_annotations(base)}
        ports = declared | set(dir(kind))
        handlers = [name for name in dir(kind) if name.startswith("on_") and callable(getattr(kind, name))]
        orphans |= {f"{kind.__module__}.{name}" for name in handlers if name.removeprefix("on_") not in ports}
    assert orphans == set()
