"""The ROS graph: nodes and their endpoints from liveliness tokens, and endpoints that do not match."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import zenoh
from zenoh import handlers

from chefbot.ros2.rmw.errors import ErrorCounter, RmwError
from chefbot.ros2.rmw.liveliness import (
    CLIENT,
    PUBLISHER,
    SERVER,
    SUBSCRIPTION,
    EndpointInfo,
    NodeId,
    Token,
    all_tokens,
    parse_token,
)
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import incompatible

_ACTION = "/_action/"
NO_TYPE_HASH = "TypeHashNotSupported"
"""Type hash that ROS 2 Humble announces; its endpoints never match those of newer distributions."""


class Endpoint(NamedTuple):
    """A publisher, subscription, server or client together with its node and GID."""

    node: NodeId
    info: EndpointInfo
    gid: bytes


class EndpointGroup(NamedTuple):
    """All endpoints of one topic or service."""

    name: str
    types: tuple[InterfaceType, ...]
    """Types of the endpoints; more than one only if they disagree."""
    providers: tuple[Endpoint, ...]
    """Publishers of the topic, or servers of the service."""
    consumers: tuple[Endpoint, ...]
    """Subscriptions of the topic, or clients of the service."""


class Graph:
    """A view of the ROS graph, kept up to date by Zenoh's threads. Thread-safe.

    Nodes of ROS 2 itself appear like our own. Tokens that cannot be parsed are counted in `refused`.
    """

    def __init__(self, session: zenoh.Session, domain: int, refused: ErrorCounter) -> None:
        self._session = session
        self._domain = domain
        self._refused = refused
        self._tokens: dict[str, Token] = {}
        self._changed = threading.Condition()
        self._callbacks: list[Callable[[], None]] = []
        self._subscriber = session.liveliness().declare_subscriber(
            all_tokens(domain), self._receive, history=True
        )

    def close(self) -> None:
        """Stop observing the liveliness tokens."""
        self._subscriber.undeclare()

    def refresh(self, timeout: float = 1.0) -> None:
        """Query all tokens and wait for the replies; meant for processes that have just started.

        The wait has a timeout because Zenoh may never report the last reply of a router that is shutting
        down.
        """
        done = threading.Event()

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._add(str(reply.ok.key_expr))

        handler = handlers.Callback(on_reply, done.set, indirect=False)
        self._session.liveliness().get(all_tokens(self._domain), handler, timeout=timeout)
        done.wait(timeout)

    def on_change(self, callback: Callable[[], None]) -> None:
        """Register a callback for appearing and disappearing tokens; it must return at once."""
        self._callbacks.append(callback)

    def wait_for(self, condition: Callable[[Graph], Any], timeout: float) -> bool:
        """Wait until `condition(graph)` holds; return False if it does not within `timeout` seconds."""
        deadline = time.monotonic() + timeout
        while not condition(self):
            remaining = deadline - time.monotonic()
            if remaining <= 0:
                return False
            with self._changed:
                self._changed.wait(min(remaining, 0.1))
        return True

    def tokens(self) -> list[Token]:
        """Return all tokens, sorted by their text."""
        with self._changed:
            return [self._tokens[text] for text in sorted(self._tokens)]

    def nodes(self) -> list[NodeId]:
        """Return all nodes; several may have the same name."""
        return [token.node for token in self.tokens() if token.endpoint is None]

    def endpoints_of(self, full_name: str) -> list[Endpoint]:
        """Return the endpoints of all nodes with a full name such as '/robot1/base'."""
        return [endpoint for endpoint in self._endpoints() if endpoint.node.full_name == full_name]

    def topics(self) -> dict[str, EndpointGroup]:
        """Return all topics by name, including the hidden topics of actions."""
        return self._named(PUBLISHER, SUBSCRIPTION)

    def services(self) -> dict[str, EndpointGroup]:
        """Return all services by name, including the hidden services of actions."""
        return self._named(SERVER, CLIENT)

    def actions(self) -> dict[str, EndpointGroup]:
        """Return all actions by name.

        Each has the endpoints of its send_goal service, and the types of the action.
        """
        found = {}
        for name, named in self.services().items():
            if name.endswith(_ACTION + "send_goal"):
                types = tuple(
                    InterfaceType(kind.name.removesuffix("_SendGoal"), kind.hash) for kind in named.types
                )
                short = name.removesuffix(_ACTION + "send_goal")
                found[short] = named._replace(name=short, types=types)
        return found

    def mismatches(self) -> list[str]:
        """Return one sentence for each pair of endpoints that share a name but cannot communicate."""
        found: list[str] = []
        for named in [*self.topics().values(), *self.services().values()]:
            for provider in named.providers:
                for consumer in named.consumers:
                    if not _matches_otherwise(named, provider, consumer):
                        found += _mismatch(named.name, provider, consumer)
        return sorted(set(found))

    def _endpoints(self) -> list[Endpoint]:
        return [
            Endpoint(token.node, token.endpoint, token.gid)
            for token in self.tokens()
            if token.endpoint is not None
        ]

    def _named(self, provider: str, consumer: str) -> dict[str, EndpointGroup]:
        groups: dict[str, list[Endpoint]] = {}
        for endpoint in self._endpoints():
            if endpoint.info.kind in (provider, consumer):
                groups.setdefault(endpoint.info.topic, []).append(endpoint)
        return {name: _group(name, ends, provider) for name, ends in sorted(groups.items())}

    def _receive(self, sample: zenoh.Sample) -> None:
        text = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._add(text)
        else:
            with self._changed:
                self._tokens.pop(text, None)
                self._changed.notify_all()
        for callback in self._callbacks:
            callback()

    def _add(self, text: str) -> None:
        try:
            token = parse_token(text)
        except RmwError as error:
            self._refused.add(f"liveliness token: {error}")
            return
        with self._changed:
            self._tokens[text] = token
            self._changed.notify_all()


def _group(name: str, endpoints: list[Endpoint], provider_kind: str) -> EndpointGroup:
    """Group the endpoints of one name; types that are offered come before types only requested."""
    providers = tuple(endpoint for endpoint in endpoints if endpoint.info.kind == provider_kind)
    consumers = tuple(endpoint for endpoint in endpoints if endpoint.info.kind != provider_kind)
    types = tuple(dict.fromkeys(endpoint.info.type for endpoint in (*providers, *consumers)))
    return EndpointGroup(name, types, providers, consumers)


def _matches_otherwise(named: EndpointGroup, provider: Endpoint, consumer: Endpoint) -> bool:
    """Return whether the two nodes match by another endpoint, in another version of the type."""
    offered, requested = provider.info.type, consumer.info.type
    return offered != requested and (
        any(
            endpoint.node == provider.node and endpoint.info.type == requested for endpoint in named.providers
        )
        or any(
            endpoint.node == consumer.node and endpoint.info.type == offered for endpoint in named.consumers
        )
    )


def _mismatch(name: str, provider: Endpoint, consumer: Endpoint) -> list[str]:
    pair = f"{name}: {provider.node.full_name} and {consumer.node.full_name}"
    offered, requested = provider.info.type, consumer.info.type
    if offered.name != requested.name:
        return [f"{pair} cannot communicate: one has {offered.name}, the other {requested.name}"]
    if offered.hash != requested.hash:
        if NO_TYPE_HASH in (offered.hash, requested.hash):
            return [f"{pair} cannot communicate: one of them is ROS 2 Humble, which has no type hashes"]
        return [f"{pair} cannot communicate: they have {offered.name} in two versions, whose hashes differ"]
    return [f"{pair}: {reason}" for reason in incompatible(provider.info.qos, consumer.info.qos)]
