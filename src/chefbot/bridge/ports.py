"""Ports of a runtime node: its topics and actions."""

from __future__ import annotations

import typing
from typing import Any, NamedTuple

from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.runtime.actions import ActionClientPort, ActionServerPort, served_actions
from chefbot.runtime.launch import Launch, node_class
from chefbot.runtime.node import RESTORED_PREFIX, In, Node, Out, TopicSpec


class Topic(NamedTuple):
    """A topic as the loop names it, without a leading slash."""

    name: str
    kind: type[Message]
    latched: bool = False


class Ports(NamedTuple):
    """All ports of a node, with names as in the loop.

    Topics that only restore state after a restart are internal and left out.
    """

    subscriptions: tuple[Topic, ...]
    publishers: tuple[Topic, ...]
    action_servers: tuple[tuple[str, Action[Any, Any, Any]], ...]
    action_clients: tuple[tuple[str, Action[Any, Any, Any]], ...]


class LaunchPorts(NamedTuple):
    """Names that the nodes of a launch provide, in whatever process they run."""

    latched: frozenset[str]
    """Topics that are published as latched (transient local)."""
    actions: frozenset[str] = frozenset()
    """Actions that are served."""


def launch_ports(launch: Launch) -> LaunchPorts:
    """Return what the nodes of the launch provide, after remapping."""
    topics: set[str] = set()
    actions: set[str] = set()
    for name, entry in launch.nodes.items():
        node_type = node_class(entry.kind, f"launch {launch.name}: node {name}")
        topics |= {entry.remap.get(topic, topic) for topic in _latched_topics(node_type)}
        actions |= {entry.remap.get(action, action) for action in served_actions(node_type)}
    return LaunchPorts(frozenset(topics), frozenset(actions))


def _latched_topics(node_type: type[Node]) -> list[str]:
    specs = {port: getattr(node_type, port, None) for port in typing.get_type_hints(node_type)}
    return [spec.name or port for port, spec in specs.items() if isinstance(spec, TopicSpec) and spec.latched]


def ports_of(node: Node) -> Ports:
    """Return the ports of a constructed node, after remapping."""
    ports = {
        id(value): value
        for value in vars(node).values()
        if isinstance(value, (Out, ActionServerPort, ActionClientPort))
    }
    values = list(ports.values())  # a node may hold the same port under two names
    return Ports(
        _subscriptions(node),
        tuple(
            Topic(port.topic, port.kind, port.latched)
            for port in values
            if isinstance(port, Out) and port.advertised
        ),
        tuple((port.name, port.action) for port in values if isinstance(port, ActionServerPort)),
        tuple((port.name, port.action) for port in values if isinstance(port, ActionClientPort)),
    )


def _subscriptions(node: Node) -> tuple[Topic, ...]:
    hints = typing.get_type_hints(type(node))
    return tuple(
        Topic(getattr(node, name).topic, typing.get_args(hint)[0])
        for name, hint in hints.items()
        if typing.get_origin(hint) is In and not getattr(node, name).topic.startswith(RESTORED_PREFIX)
    )
