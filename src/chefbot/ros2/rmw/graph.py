"""Who is there: nodes and their ends, from liveliness tokens, and what of it cannot work together."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import zenoh
from zenoh import handlers

from chefbot.ros2.rmw.errors import Tally, WireError
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.qos import incompatible
from chefbot.ros2.rmw.tokens import (
    CLIENT,
    PUBLISHER,
    SERVER,
    SUBSCRIPTION,
    End,
    NodeId,
    Token,
    all_tokens,
    parse_token,
)

_ACTION = "/_action/"
HASHLESS = "TypeHashNotSupported"
"""What Humble writes; its data never meets that of newer distributions."""


class Endpoint(NamedTuple):
    """One end and the node that has it."""

    node: NodeId
    end: End
    gid: bytes


class Named(NamedTuple):
    """All ends of one topic or service."""

    name: str
    types: tuple[WireType, ...]
    """One, unless its ends disagree."""
    givers: tuple[Endpoint, ...]
    """Publishers, or servers."""
    takers: tuple[Endpoint, ...]
    """Subscriptions, or clients."""


class Graph:
    """Kept up to date by Zenoh's threads; every method may be called from any thread.

    Tokens of ROS 2's own nodes are here like ours. Tokens that cannot be read are counted in `refused`.
    """

    def __init__(self, session: zenoh.Session, domain: int, refused: Tally) -> None:
        self._session = session
        self._domain = domain
        self._refused = refused
        self._tokens: dict[str, Token] = {}
        self._changed = threading.Condition()
        self._listeners: list[Callable[[], None]] = []
        self._subscriber = session.liveliness().declare_subscriber(
            all_tokens(domain), self._receive, history=True
        )

    def close(self) -> None:
        """Listen no more."""
        self._subscriber.undeclare()

    def refresh(self, timeout: float = 1.0) -> None:
        """Ask for all tokens now and wait for the answers: for programs that have only just come.

        Over gates to machines that are just going, Zenoh may never say that the last answer has come.
        """
        done = threading.Event()

        def take(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._add(str(reply.ok.key_expr))

        handler = handlers.Callback(take, done.set, indirect=False)
        self._session.liveliness().get(all_tokens(self._domain), handler, timeout=timeout)
        done.wait(timeout)

    def on_change(self, listener: Callable[[], None]) -> None:
        """Call from Zenoh's thread whenever a token came or went; must return at once."""
        self._listeners.append(listener)

    def wait_for(self, condition: Callable[[Graph], Any], timeout: float) -> bool:
        """Wait until `condition(graph)` holds; False if it does not in `timeout` seconds."""
        until = time.monotonic() + timeout
        while not condition(self):
            rest = until - time.monotonic()
            if rest <= 0:
                return False
            with self._changed:
                self._changed.wait(min(rest, 0.1))
        return True

    def tokens(self) -> list[Token]:
        """All of them, sorted by their text."""
        with self._changed:
            return [self._tokens[text] for text in sorted(self._tokens)]

    def nodes(self) -> list[NodeId]:
        """All nodes; two may have one name."""
        return [token.node for token in self.tokens() if token.end is None]

    def ends_of(self, full_name: str) -> list[Endpoint]:
        """What the nodes called '/robot1/base' do."""
        return [one for one in self._endpoints() if one.node.full_name == full_name]

    def topics(self) -> dict[str, Named]:
        """By name, hidden ones of actions included."""
        return self._named(PUBLISHER, SUBSCRIPTION)

    def services(self) -> dict[str, Named]:
        """By name, hidden ones of actions included."""
        return self._named(SERVER, CLIENT)

    def actions(self) -> dict[str, Named]:
        """By name, each with its send_goal service's ends; types are the actions'."""
        found = {}
        for name, named in self.services().items():
            if name.endswith(_ACTION + "send_goal"):
                types = tuple(
                    WireType(kind.name.removesuffix("_SendGoal"), kind.hash) for kind in named.types
                )
                short = name.removesuffix(_ACTION + "send_goal")
                found[short] = named._replace(name=short, types=types)
        return found

    def mismatches(self) -> list[str]:
        """What looks connected and is not: a sentence for each pair of ends that cannot work together."""
        found: list[str] = []
        for named in [*self.topics().values(), *self.services().values()]:
            for giver in named.givers:
                for taker in named.takers:
                    if not _otherwise(named, giver, taker):
                        found += _mismatch(named.name, giver, taker)
        return sorted(set(found))

    def _endpoints(self) -> list[Endpoint]:
        return [Endpoint(one.node, one.end, one.gid) for one in self.tokens() if one.end is not None]

    def _named(self, giver: str, taker: str) -> dict[str, Named]:
        groups: dict[str, list[Endpoint]] = {}
        for one in self._endpoints():
            if one.end.kind in (giver, taker):
                groups.setdefault(one.end.topic, []).append(one)
        return {name: _group(name, ends, giver) for name, ends in sorted(groups.items())}

    def _receive(self, sample: zenoh.Sample) -> None:
        text = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._add(text)
        else:
            with self._changed:
                self._tokens.pop(text, None)
                self._changed.notify_all()
        for listener in self._listeners:
            listener()

    def _add(self, text: str) -> None:
        try:
            token = parse_token(text)
        except WireError as error:
            self._refused.add(f"liveliness token: {error}")
            return
        with self._changed:
            self._tokens[text] = token
            self._changed.notify_all()


def _group(name: str, ends: list[Endpoint], giver: str) -> Named:
    """What is published comes before what somebody would like to hear."""
    givers = tuple(one for one in ends if one.end.kind == giver)
    takers = tuple(one for one in ends if one.end.kind != giver)
    types = tuple(dict.fromkeys(one.end.type for one in (*givers, *takers)))
    return Named(name, types, givers, takers)


def _otherwise(named: Named, giver: Endpoint, taker: Endpoint) -> bool:
    """Whether the two nodes meet by another end of one of them: it speaks several editions of the type."""
    given, taken = giver.end.type, taker.end.type
    return given != taken and (
        any(one.node == giver.node and one.end.type == taken for one in named.givers)
        or any(one.node == taker.node and one.end.type == given for one in named.takers)
    )


def _mismatch(name: str, giver: Endpoint, taker: Endpoint) -> list[str]:
    who = f"{name}: {giver.node.full_name} and {taker.node.full_name}"
    ours, theirs = giver.end.type, taker.end.type
    if ours.name != theirs.name:
        return [f"{who} do not hear each other: the one has {ours.name}, the other {theirs.name}"]
    if ours.hash != theirs.hash:
        if HASHLESS in (ours.hash, theirs.hash):
            return [f"{who} do not hear each other: one of them is ROS 2 Humble, which tells no type hashes"]
        return [f"{who} do not hear each other: they have {ours.name} in two versions, whose hashes differ"]
    return [f"{who}: {reason}" for reason in incompatible(giver.end.qos, taker.end.qos)]
