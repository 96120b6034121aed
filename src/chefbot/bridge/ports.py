"""What a node of the runtime has: the topics and actions that its ports stand for."""

from __future__ import annotations

import typing
from typing import Any, NamedTuple

from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.runtime.actions import Calls, Serves
from chefbot.runtime.launch import Launch, node_class
from chefbot.runtime.node import LAST_WORDS, In, Node, Out, TopicSpec


class Topic(NamedTuple):
    """A topic as the loop names it, without a leading slash."""

    name: str
    kind: type[Message]
    latched: bool = False


class Ports(NamedTuple):
    """All ports of a node; action names are the loop's too. Last words are nobody else's business and left out."""

    ins: tuple[Topic, ...]
    outs: tuple[Topic, ...]
    serves: tuple[tuple[str, Action[Any, Any, Any]], ...]
    calls: tuple[tuple[str, Action[Any, Any, Any]], ...]


def latched_topics(launch: Launch) -> frozenset[str]:
    """Topics on which some node of the launch, wherever it runs, speaks to those who come later too."""
    found: set[str] = set()
    for name, entry in launch.nodes.items():
        kind = node_class(entry.kind, f"launch {launch.name}: node {name}")
        for port in typing.get_type_hints(kind):
            spec = getattr(kind, port, None)
            if isinstance(spec, TopicSpec) and spec.latched:
                topic = spec.name or port
                found.add(entry.remap.get(topic, topic))
    return frozenset(found)


def ports_of(node: Node) -> Ports:
    """Of a node that is made, remapping done."""
    hints = typing.get_type_hints(type(node))
    ins = tuple(
        Topic(getattr(node, name).topic, typing.get_args(hint)[0])
        for name, hint in hints.items()
        if typing.get_origin(hint) is In and not getattr(node, name).topic.startswith(LAST_WORDS)
    )
    ports = {id(value): value for value in vars(node).values() if isinstance(value, (Out, Serves, Calls))}
    values = list(ports.values())  # a node may have a second name for one of its ports
    return Ports(
        ins,
        tuple(
            Topic(one.topic, one.kind, one.latched) for one in values if isinstance(one, Out) and one.offered
        ),
        tuple((one.name, one.action) for one in values if isinstance(one, Serves)),
        tuple((one.name, one.action) for one in values if isinstance(one, Calls)),
    )
