"""Shared helpers of the graph tools: joining the graph, names, types, input and output."""

from __future__ import annotations

import os
import re
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import yaml
from rich.console import Console

from chefbot.config import parse_yaml
from chefbot.errors import ChefbotError, name_hint
from chefbot.ros2.rmw.environment import domain_from_environment, port_from_environment
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.graph import NO_TYPE_HASH, EndpointGroup, Graph
from chefbot.ros2.rmw.names import InterfaceType, resolve
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import LOOPBACK, RmwContext
from chefbot.signals import stop_on_signals

T = TypeVar("T")
START_WAIT, QUIET_WAIT = 30.0, 1.0
"""Maximum wait for a launch that is starting, and the part of it before a message is printed, s."""
LAUNCH = "/chefbot"
"""Name of a launch's own node, which appears some seconds before the others."""
NAME_WAIT = 1.0
"""Maximum time to wait for a name that is not in the graph, s."""
SETTLED_TIME, SETTLE_WAIT = 0.25, 2.0
"""Time without graph changes after which the graph counts as complete, and its maximum wait, s."""
NO_MESSAGE_TIMEOUT = 2.0
"""Time without a message after which the reasons are printed, s."""
MAX_SHOWN_ELEMENTS = 128
"""Maximum number of array elements shown."""
SHORT_HASH = 19
_TYPE = re.compile(r"[a-z]\w*/(?:(?:msg|srv|action)/)?[A-Z]\w*")
console = Console(highlight=False, soft_wrap=True, markup=False, emoji=False)
errors = Console(highlight=False, soft_wrap=True, markup=False, emoji=False, stderr=True)


@contextmanager
def graph_node(verb: str, *, alone: bool = False) -> Iterator[RmwNode]:
    """Provide a node for the duration of a command, with the complete graph.

    Raises ToolError when there are no other nodes, unless `alone`: then the command opens the network for
    late-joining nodes and its node is visible under the name `verb`; otherwise it is hidden, as tools are.
    """
    port, domain = port_from_environment(), domain_from_environment()
    with RmwContext(domain, port=port, router=alone) as wire:
        if not alone and not wire.graph.wait_for(_has_node, QUIET_WAIT):
            errors.print(f"chefbot: no ROS nodes found at {LOOPBACK}:{port} yet; waiting {START_WAIT:g} s")
            if not wire.graph.wait_for(_has_node, START_WAIT):
                raise ToolError(
                    f"no ROS nodes found at {LOOPBACK}:{port}, domain {domain}; start a launch first, "
                    "or rmw_zenohd where ROS 2's own nodes run"
                )
        with RmwNode(wire, verb if alone else f"_chefbot_{verb}_{os.getpid()}") as node:
            settle(wire.graph)
            yield node


def _has_node(graph: Graph) -> bool:
    """Return whether there is a node that is neither a tool nor a launch that is still starting its nodes."""
    return any(not is_hidden(node.full_name) and node.full_name != LAUNCH for node in graph.nodes())


def settle(graph: Graph) -> None:
    """Wait until the graph no longer changes."""
    graph.refresh()
    deadline = time.monotonic() + SETTLE_WAIT
    count, unchanged_since = -1, time.monotonic()
    while time.monotonic() < deadline and (time.monotonic() - unchanged_since < SETTLED_TIME or count < 2):
        # Restart the quiet period whenever the number of tokens changes
        if (now := len(graph.tokens())) != count:
            count, unchanged_since = now, time.monotonic()
        time.sleep(0.02)


@contextmanager
def stop_event() -> Iterator[threading.Event]:
    """Provide an event that Ctrl-C and SIGTERM set, instead of ending the program."""
    stop = threading.Event()
    with stop_on_signals(stop.set):
        yield stop


class ToolError(ChefbotError):
    """A request to a ROS 2 tool that names nothing on the network, or that a node did not fulfil."""


class UnknownTypeError(ToolError):
    """A message, service or action type of which there is no matching definition."""


def full_name(name: str) -> str:
    """Return the full name of a topic or service; raises ToolError for an invalid name."""
    try:
        return resolve(name)
    except RmwError as error:
        raise ToolError(str(error)) from None


def find(lookup: Callable[[], Mapping[str, T]], name: str, what: str) -> T:
    """Return the entry of a topic, service, action or node, waiting briefly for it to appear.

    Raises ToolError with the nearest names.
    """
    full, deadline = full_name(name), time.monotonic() + NAME_WAIT
    while full not in (entries := lookup()) and time.monotonic() < deadline:
        time.sleep(0.05)
    if full not in entries:
        candidates = {candidate for candidate in entries if not is_hidden(candidate)}
        raise ToolError(
            f"there is no {what} {full} on the wire{name_hint(full, candidates) or '; there are none at all'}"
        )
    return entries[full]


def is_hidden(name: str) -> bool:
    """Return whether some part of the name begins with _, as ROS 2 names tools and action internals."""
    return "/_" in name


def only_type(named: EndpointGroup, what: str) -> InterfaceType:
    """Return the type of the publishers or servers; raises ToolError when they disagree."""
    types = list(dict.fromkeys(endpoint.info.type for endpoint in (named.providers or named.consumers)))
    if len(types) > 1:
        raise ToolError(f"{what} {named.name} has more than one type: {', '.join(map(type_text, types))}")
    return types[0]


def local_definition(kind: InterfaceType, find_type: Callable[[str], T], what: str) -> T:
    """Return our definition of a type in the graph.

    Raises UnknownTypeError with the hashes when it is unknown or of another version.
    """
    try:
        found = find_type(kind.name)
    except KeyError:
        raise UnknownTypeError(
            f"{what} has the type {type_text(kind)}, of which there is no definition here"
        ) from None
    ours = InterfaceType.of(found).hash  # type: ignore[arg-type]
    if kind.hash != ours:
        theirs = "no hash (ROS 2 Humble)" if kind.hash == NO_TYPE_HASH else f"hash {kind.hash}"
        raise UnknownTypeError(f"{what} has {kind.name} in another version: {theirs} there, {ours} here")
    return found


def type_text(kind: InterfaceType) -> str:
    """Return the name of a type and the beginning of its hash."""
    return f"{kind.name} ({kind.hash[:SHORT_HASH]}{'...' if len(kind.hash) > SHORT_HASH else ''})"


def type_name(name: str, folder: str) -> str:
    """Return the full type name: 'geometry_msgs/Twist' becomes 'geometry_msgs/msg/Twist' in `folder` msg."""
    return name.replace("/", f"/{folder}/") if name.count("/") == 1 else name


def type_and_values(arguments: Sequence[str]) -> tuple[str, Any]:
    """Parse the arguments `[TYPE] [VALUES]`; the type is '' if it is left out.

    ROS 2's tools need the type; here it is known from the graph.
    """
    remaining = list(arguments)
    type_given = remaining.pop(0) if remaining and _TYPE.fullmatch(remaining[0]) else ""
    if len(remaining) > 1:
        raise ToolError("write [TYPE] VALUES, the values as YAML or JSON in quotes: '{linear: {x: 0.1}}'")
    return type_given, parse_yaml(remaining[0].encode(), "the values") if remaining else None


def mismatches(graph: Graph, name: str = "") -> list[str]:
    """Return the sentences on incompatible endpoints of one name or of all, without those of tools."""
    sentences = [sentence for sentence in graph.mismatches() if not is_hidden(sentence.partition(":")[2])]
    return [sentence for sentence in sentences if not name or sentence.startswith(f"{name}:")]


class _Dumper(yaml.SafeDumper):
    """A YAML dumper that keeps Unicode line breaks.

    PyYAML writes them in single quotes, where they are read back as other line breaks.
    """

    def represent_str(self, data: str) -> yaml.ScalarNode:
        """Represent strings with Unicode line breaks escaped, in double quotes."""
        folded = any(character in data for character in "\x85\u2028\u2029")
        return self.represent_scalar("tag:yaml.org,2002:str", data, style='"' if folded else None)


_Dumper.add_representer(str, _Dumper.represent_str)


def to_yaml(plain: Any) -> str:
    """Return readable YAML, with lists of plain values on one line."""
    text: str = yaml.dump(
        plain, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True
    )
    return text.rstrip().removesuffix("\n...")


def columns(rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Align the rows of a table in columns and yield its lines."""
    table = [list(row) for row in rows]
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))] if table else []
    for row in table:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def print_with_servers(entries: Iterable[EndpointGroup], verbose: bool) -> None:
    """Print the names that have a server, one per line; with types and servers if `verbose`."""
    rows = [
        [
            entry.name,
            ", ".join(dict.fromkeys(kind.name for kind in entry.types)),
            entry.providers[0].node.full_name,
        ]
        for entry in entries
        if entry.providers
    ]
    for line in columns(rows if verbose else [row[:1] for row in rows]):
        console.print(line)
