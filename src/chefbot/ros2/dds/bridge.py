"""Both sides of the bridge: who is there on Zenoh and on DDS, and what therefore has to be copied."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from cyclonedds.core import GuardCondition, InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.topic import Topic

from chefbot.msgs.idl.message import Message
from chefbot.ros2.dds.discovery import TOPIC_PREFIX, Discovery
from chefbot.ros2.dds.domain import Place
from chefbot.ros2.dds.inward import Inward
from chefbot.ros2.dds.nodes import Nodes
from chefbot.ros2.dds.outward import Outward
from chefbot.ros2.dds.topic_endpoints import Crowd, choose_type, gather, unheard
from chefbot.ros2.dds.types import sample_type
from chefbot.ros2.rmw.errors import Tally
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.session import Wire

NODE = "chefbot_dds"
LOOK_NS = 200_000_000
SETTLE = 0.02
"""Seconds in which news of the graph are gathered: a launch comes with hundreds of tokens."""
CHECK = 0.5
"""Seconds between two looks for ends that DDS has not connected."""
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
Chosen = Callable[[str], bool]


class Topics(NamedTuple):
    """What is copied now, by topic."""

    outward: tuple[str, ...]
    """From Zenoh to DDS."""
    inward: tuple[str, ...]
    """From DDS to Zenoh."""
    left_out: dict[str, str]
    """And why."""


class DdsBridge:
    """Copies between `wire` and a place in a DDS domain until `close`; `chosen` says which topics.

    All DDS entities are made and ended in the bridge's own thread; Zenoh's threads write to DDS.
    """

    def __init__(self, wire: Wire, place: Place, chosen: Chosen) -> None:
        self.tally: Tally = wire.refused
        self._wire, self._place, self._chosen = wire, place, chosen
        self._ends = WireNode(wire, NODE, remote_only=True)
        participant = place.participant
        self._discovery = Discovery(participant)
        self._nodes = Nodes(participant)
        self._outward: dict[str, Outward] = {}
        self._inward: dict[str, Inward] = {}
        self._kinds: dict[str, type[Message]] = {}
        self._listeners: dict[str, list[str]] = {}
        self._topics: dict[tuple[str, type[Message]], Any] = {}
        self._left_out: dict[str, str] = {}
        self._state = Topics((), (), {})
        self._news, self._closing = threading.Event(), threading.Event()
        self._wake = GuardCondition(participant)
        self._waiting = WaitSet(participant)
        self._waiting.attach(self._wake)
        for reader in self._discovery.readers:
            self._waiting.attach(ReadCondition(reader, _ANY))
        wire.graph.on_change(self._graph_changed)
        self._graph_changed()
        self._thread = threading.Thread(target=self._work, name="dds", daemon=True)
        self._thread.start()

    @property
    def topics(self) -> Topics:
        """What is copied now; any thread."""
        return self._state

    def close(self) -> None:
        """End all that was made on both sides."""
        self._closing.set()
        self._wake.set(True)
        self._thread.join()
        self._ends.close()
        self._place.close()

    def _graph_changed(self) -> None:
        """In Zenoh's thread."""
        if not self._closing.is_set():
            self._news.set()
            self._wake.set(True)

    def _work(self) -> None:
        due, check_at = 0.0, 0.0
        more = False
        while not self._closing.is_set():
            if not more:
                self._waiting.wait(int(SETTLE * 1e9) if due else LOOK_NS)
            self._wake.set(False)
            if self._do(self._discovery.look) or self._news.is_set():
                due = due or time.monotonic() + SETTLE
                self._news.clear()
            if due and time.monotonic() >= due:
                due = 0.0
                self._do(self._arrange)
            if time.monotonic() >= check_at:
                check_at = time.monotonic() + CHECK
                self._do(self._check)
            more = sum(bool(self._do(one.copy)) for one in self._inward.values()) > 0
        for name in list(self._outward):
            self._end(name)

    def _do(self, job: Callable[[], Any]) -> Any:
        """One topic's trouble is told and does not end the others."""
        try:
            return job()
        except Exception as fault:
            self.tally.add(f"bridge: {type(fault).__name__}: {fault}")
            return None

    def _arrange(self) -> None:
        """Make what is wanted now and end what is not."""
        crowds = gather(self._wire, self._discovery)
        left_out: dict[str, str] = {}
        routes = {}
        for name, crowd in crowds.items():
            if self._chosen(name):
                kind, why = choose_type(crowd)
                if why := why or unheard(crowd):
                    left_out[name] = why
                if kind is not None:
                    routes[name] = (kind, crowd.of_type(WireType.of(kind)))
        for name in (self._outward.keys() | self._inward.keys()) - routes.keys():
            self._end(name)
        for name, (kind, crowd) in routes.items():
            self._do(partial(self._arrange_topic, name, kind, crowd))
        self._do(self._tell_nodes)
        self._left_out = left_out
        self._state = Topics(*self._directions(routes), left_out)

    def _check(self) -> None:
        """Whom DDS itself refuses to connect."""
        deaf = {name: why for name, one in self._inward.items() if (why := one.deaf())}
        self._state = self._state._replace(left_out={**deaf, **self._left_out})

    def _arrange_topic(self, name: str, kind: type[Message], crowd: Crowd) -> None:
        if self._kinds.get(name, kind) is not kind:
            self._end(name)
        self._kinds[name] = kind
        if name not in self._outward:
            topic = self._topic(name, kind)
            participant = self._place.participant
            self._outward[name] = Outward(participant, topic, self._ends, name, kind)
            here = (participant, topic, self._waiting)
            self._inward[name] = Inward(here, self._ends, name, WireType.of(kind), self.tally)
        self._outward[name].update(crowd.publishers, bool(crowd.readers))
        self._inward[name].update(crowd.writers, crowd.listeners)
        self._listeners[name] = [one.node.full_name for one in crowd.listeners]

    def _end(self, name: str) -> None:
        for routes in (self._outward, self._inward):
            if name in routes:
                self._do(routes.pop(name).close)
        self._kinds.pop(name, None)
        self._listeners.pop(name, None)

    def _topic(self, name: str, kind: type[Message]) -> Any:
        """DDS has one of each name and type, whoever reads and writes it."""
        key = (name, kind)
        if key not in self._topics:
            self._topics[key] = Topic(self._place.participant, TOPIC_PREFIX + name, sample_type(kind))
        return self._topics[key]

    def _tell_nodes(self) -> None:
        readers: dict[str, list[bytes]] = {}
        writers: dict[str, list[bytes]] = {}
        for route in self._outward.values():
            for owner, gid in route.gids():
                writers.setdefault(owner, []).append(gid)
        for name, inward in self._inward.items():
            if inward.gid is not None:
                for owner in dict.fromkeys(self._listeners[name]):
                    readers.setdefault(owner, []).append(inward.gid)
        there = [one for one in self._wire.graph.nodes() if one.zid != self._wire.zid]
        self._nodes.tell([*there, self._ends.id], readers, writers)

    @staticmethod
    def _directions(
        routes: dict[str, tuple[type[Message], Crowd]],
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        outward = tuple(name for name, (_, crowd) in routes.items() if crowd.publishers)
        inward = tuple(name for name, (_, crowd) in routes.items() if crowd.writers or crowd.listeners)
        return outward, inward
