"""What the verbs of the wire share: being on it for a while, names, types, what people write and read."""

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
from chefbot.errors import UserError, nearest
from chefbot.ros2.rmw.environment import domain_of_environment, port_of_environment
from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.graph import HASHLESS, Graph, Named
from chefbot.ros2.rmw.names import WireType, resolve
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.session import LOOPBACK, Wire
from chefbot.signals import stop_on_signals

T = TypeVar("T")
START_WAIT, QUIET_WAIT = 30.0, 1.0
"""Seconds that a launch which is only just starting is waited for, the first of them without a word."""
LAUNCH = "/chefbot"
"""A launch's own node, which is there some seconds before the others."""
NAME_WAIT = 1.0
"""Seconds that a name which is not there may take to come."""
SETTLED, SETTLE_WAIT = 0.25, 2.0
"""Seconds without news after which all are known, and how long that is waited for at most."""
SILENCE = 2.0
"""Seconds without a message after which the reasons are told."""
SHOWN = 128
"""Elements of an array that are shown."""
SHORT_HASH = 19
_TYPE = re.compile(r"[a-z]\w*/(?:(?:msg|srv|action)/)?[A-Z]\w*")
console = Console(highlight=False, soft_wrap=True, markup=False, emoji=False)
errors = Console(highlight=False, soft_wrap=True, markup=False, emoji=False, stderr=True)


@contextmanager
def on_wire(verb: str, *, alone: bool = False) -> Iterator[WireNode]:
    """A node that is there for this command only, and knows all others.

    UserError when nobody is there, unless it may be `alone`: then it opens the wire for those who come later, and
    is seen as a node that is called `verb`; others are hidden, as tools are.
    """
    port, domain = port_of_environment(), domain_of_environment()
    with Wire(domain, port=port, router=alone) as wire:
        if not alone and not wire.graph.wait_for(_somebody, QUIET_WAIT):
            errors.print(f"chefbot: nobody is on the wire at {LOOPBACK}:{port} yet; waiting {START_WAIT:g} s")
            if not wire.graph.wait_for(_somebody, START_WAIT):
                raise UserError(
                    f"nobody is on the wire at {LOOPBACK}:{port}, domain {domain}; start a launch first, "
                    "or rmw_zenohd where ROS 2's own nodes run"
                )
        with WireNode(wire, verb if alone else f"_chefbot_{verb}_{os.getpid()}") as node:
            settle(wire.graph)
            yield node


def _somebody(graph: Graph) -> bool:
    """Whether there is a node that is no tool, and not only a launch that is about to bring its nodes."""
    return any(not hidden(one.full_name) and one.full_name != LAUNCH for one in graph.nodes())


def settle(graph: Graph) -> None:
    """Until all tokens have come."""
    graph.refresh()
    until = time.monotonic() + SETTLE_WAIT
    count, since = -1, time.monotonic()
    while time.monotonic() < until and (time.monotonic() - since < SETTLED or count < 2):
        if (now := len(graph.tokens())) != count:
            count, since = now, time.monotonic()
        time.sleep(0.02)


@contextmanager
def stopping() -> Iterator[threading.Event]:
    """An event that Ctrl-C and SIGTERM set, instead of ending the program."""
    stop = threading.Event()
    with stop_on_signals(stop.set):
        yield stop


def full_name(name: str) -> str:
    """'scan' and '/scan' are the same. UserError for what is no name."""
    try:
        return resolve(name)
    except WireError as error:
        raise UserError(str(error)) from None


def find(look: Callable[[], Mapping[str, T]], name: str, what: str) -> T:
    """Of a topic, service, action or node that may only just be coming; UserError with the nearest names."""
    full, until = full_name(name), time.monotonic() + NAME_WAIT
    while full not in (known := look()) and time.monotonic() < until:
        time.sleep(0.05)
    if full not in known:
        shown = {one for one in known if not hidden(one)}
        raise UserError(
            f"there is no {what} {full} on the wire{nearest(full, shown) or '; there are none at all'}"
        )
    return known[full]


def hidden(name: str) -> bool:
    """Whether some part of the name begins with _, as those of tools and inside of actions do (ROS 2)."""
    return "/_" in name


def only_type(named: Named, what: str) -> WireType:
    """Of its publishers or servers. UserError when they disagree."""
    types = list(dict.fromkeys(one.end.type for one in (named.givers or named.takers)))
    if len(types) > 1:
        raise UserError(f"{what} {named.name} has more than one type: {', '.join(map(type_text, types))}")
    return types[0]


def definition(kind: WireType, find_type: Callable[[str], T], what: str) -> T:
    """Our class for a type of the wire. UserError when it is unknown or another version, with its hash."""
    try:
        found = find_type(kind.name)
    except KeyError:
        raise UserError(
            f"{what} has the type {type_text(kind)}, of which there is no definition here"
        ) from None
    ours = WireType.of(found).hash  # type: ignore[arg-type]
    if kind.hash != ours:
        theirs = "no hash (ROS 2 Humble)" if kind.hash == HASHLESS else f"hash {kind.hash}"
        raise UserError(f"{what} has {kind.name} in another version: {theirs} there, {ours} here")
    return found


def type_text(kind: WireType) -> str:
    """Name and the beginning of the hash."""
    return f"{kind.name} ({kind.hash[:SHORT_HASH]}{'...' if len(kind.hash) > SHORT_HASH else ''})"


def type_name(given: str, folder: str) -> str:
    """'geometry_msgs/Twist' is 'geometry_msgs/msg/Twist' in `folder` msg."""
    return given.replace("/", f"/{folder}/") if given.count("/") == 1 else given


def type_and_values(words: Sequence[str]) -> tuple[str, Any]:
    """`[TYPE] [VALUES]` of the command line: ROS 2's tools want the type, we know it from the wire; '' for none."""
    rest = list(words)
    given = rest.pop(0) if rest and _TYPE.fullmatch(rest[0]) else ""
    if len(rest) > 1:
        raise UserError("write [TYPE] VALUES, the values as YAML or JSON in quotes: '{linear: {x: 0.1}}'")
    return given, parse_yaml(rest[0].encode(), "the values") if rest else None


def mismatches(graph: Graph, name: str = "") -> list[str]:
    """Who cannot hear whom, of one topic or service or of all; tools left out."""
    told = [one for one in graph.mismatches() if not hidden(one.partition(":")[2])]
    return [one for one in told if not name or one.startswith(f"{name}:")]


class _Dumper(yaml.SafeDumper):
    """The library writes line ends of Unicode in single quotes, where they come back as others."""

    def represent_str(self, data: str) -> yaml.ScalarNode:
        """Escaped, in double quotes."""
        folded = any(one in data for one in "\x85\u2028\u2029")
        return self.represent_scalar("tag:yaml.org,2002:str", data, style='"' if folded else None)


_Dumper.add_representer(str, _Dumper.represent_str)


def to_yaml(plain: Any) -> str:
    """As people read it; lists of plain values in one line."""
    text: str = yaml.dump(
        plain, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True
    )
    return text.rstrip().removesuffix("\n...")


def columns(rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Lines in which the columns stand below each other."""
    table = [list(row) for row in rows]
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))] if table else []
    for row in table:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def print_served(found: Iterable[Named], verbose: bool) -> None:
    """Those that somebody serves, a name a line; with types and servers if `verbose`."""
    rows = [
        [one.name, ", ".join(dict.fromkeys(kind.name for kind in one.types)), one.givers[0].node.full_name]
        for one in found
        if one.givers
    ]
    for line in columns(rows if verbose else [row[:1] for row in rows]):
        console.print(line)
