"""The bridge between Zenoh and DDS: it matches endpoints on both sides and copies the topics that need it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from cyclonedds.core import GuardCondition, InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.topic import Topic

from chefbot.msgs.idl.message import Message
from chefbot.ros2.dds.dds_to_zenoh import DdsToZenohRoute
from chefbot.ros2.dds.discovery import TOPIC_PREFIX, Discovery
from chefbot.ros2.dds.discovery_info import NodeAnnouncer
from chefbot.ros2.dds.domain import DdsParticipant
from chefbot.ros2.dds.topic_endpoints import (
    TopicEndpoints,
    choose_type,
    endpoints_by_topic,
    unmatched_publishers,
)
from chefbot.ros2.dds.types import sample_type
from chefbot.ros2.dds.zenoh_to_dds import ZenohToDdsRoute
from chefbot.ros2.rmw.errors import ErrorCounter
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

NODE = "chefbot_dds"
WAIT_TIMEOUT_NS = 200_000_000
SETTLE_TIME = 0.02
"""Seconds over which graph changes are batched: a launch announces hundreds of tokens."""
CHECK_PERIOD = 0.5
"""Seconds between two checks for endpoints that DDS has not matched."""
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
Chosen = Callable[[str], bool]


class BridgedTopics(NamedTuple):
    """The topics that are bridged at present, by direction."""

    outward: tuple[str, ...]
    """Topics copied from Zenoh to DDS."""
    inward: tuple[str, ...]
    """Topics copied from DDS to Zenoh."""
    left_out: dict[str, str]
    """Topics not bridged, or only in part, each with the reason."""


class DdsBridge:
    """A bridge between `wire` and a DDS participant; runs until `close`.

    `chosen(name)` selects the topics. All DDS entities are created and deleted in the bridge's own thread;
    Zenoh's threads write to DDS.
    """

    def __init__(self, wire: RmwContext, place: DdsParticipant, chosen: Chosen) -> None:
        self.rejected: ErrorCounter = wire.rejected
        self._wire, self._place, self._chosen = wire, place, chosen
        self._node = RmwNode(wire, NODE, remote_only=True)
        participant = place.participant
        self._discovery = Discovery(participant)
        self._nodes = NodeAnnouncer(participant)
        self._outward: dict[str, ZenohToDdsRoute] = {}
        self._inward: dict[str, DdsToZenohRoute] = {}
        self._kinds: dict[str, type[Message]] = {}
        self._subscribers: dict[str, list[str]] = {}
        self._topics: dict[tuple[str, type[Message]], Any] = {}
        self._left_out: dict[str, str] = {}
        self._state = BridgedTopics((), (), {})
        self._graph_news, self._closing = threading.Event(), threading.Event()
        self._wake = GuardCondition(participant)
        self._waitset = WaitSet(participant)
        self._waitset.attach(self._wake)
        for reader in self._discovery.readers:
            self._waitset.attach(ReadCondition(reader, _ANY))
        wire.graph.on_change(self._graph_changed)
        self._graph_changed()
        self._thread = threading.Thread(target=self._run, name="dds", daemon=True)
        self._thread.start()

    @property
    def topics(self) -> BridgedTopics:
        """The topics that are bridged at present; thread-safe."""
        return self._state

    def close(self) -> None:
        """Stop the bridge and delete its endpoints on both sides."""
        self._closing.set()
        self._wake.set(True)
        self._thread.join()
        self._node.close()
        self._place.close()

    def _graph_changed(self) -> None:
        """Wake the bridge's thread; called in a Zenoh thread."""
        if not self._closing.is_set():
            self._graph_news.set()
            self._wake.set(True)

    def _run(self) -> None:
        due, check_at = 0.0, 0.0
        more = False
        while not self._closing.is_set():
            if not more:
                self._waitset.wait(int(SETTLE_TIME * 1e9) if due else WAIT_TIMEOUT_NS)
            self._wake.set(False)
            # Batch graph changes of both sides for SETTLE_TIME seconds, then update the routes once
            if self._guarded(self._discovery.update) or self._graph_news.is_set():
                due = due or time.monotonic() + SETTLE_TIME
                self._graph_news.clear()
            if due and time.monotonic() >= due:
                due = 0.0
                self._guarded(self._update_routes)
            # Check periodically for endpoints that DDS did not match
            if time.monotonic() >= check_at:
                check_at = time.monotonic() + CHECK_PERIOD
                self._guarded(self._check_matches)
            # Copy new samples; skip the next wait if a route has more than it could copy in one turn
            more = sum(bool(self._guarded(route.copy)) for route in self._inward.values()) > 0
        for name in list(self._outward):
            self._close_route(name)

    def _guarded(self, job: Callable[[], Any]) -> Any:
        """Run a job; count an exception instead of raising it, so that one topic cannot stop the others."""
        try:
            return job()
        except Exception as fault:
            self.rejected.add(f"bridge: {type(fault).__name__}: {fault}")
            return None

    def _update_routes(self) -> None:
        """Create the routes that are needed now and delete the others."""
        topics = endpoints_by_topic(self._wire, self._discovery)
        left_out: dict[str, str] = {}
        routes = {}
        for name, endpoints in topics.items():
            if self._chosen(name):
                kind, reason = choose_type(endpoints)
                if reason := reason or unmatched_publishers(endpoints):
                    left_out[name] = reason
                if kind is not None:
                    routes[name] = (kind, endpoints.of_type(InterfaceType.of(kind)))
        for name in (self._outward.keys() | self._inward.keys()) - routes.keys():
            self._close_route(name)
        for name, (kind, endpoints) in routes.items():
            self._guarded(partial(self._update_route, name, kind, endpoints))
        self._guarded(self._publish_nodes)
        self._left_out = left_out
        self._state = BridgedTopics(*self._directions(routes), left_out)

    def _check_matches(self) -> None:
        """Report the writers that DDS itself refuses to match."""
        unmatched = {
            name: reason for name, route in self._inward.items() if (reason := route.unmatched_reason())
        }
        self._state = self._state._replace(left_out={**unmatched, **self._left_out})

    def _update_route(self, name: str, kind: type[Message], endpoints: TopicEndpoints) -> None:
        if self._kinds.get(name, kind) is not kind:
            self._close_route(name)
        self._kinds[name] = kind
        if name not in self._outward:
            topic = self._topic(name, kind)
            # Both directions of a topic share one DDS topic
            participant = self._place.participant
            self._outward[name] = ZenohToDdsRoute(participant, topic, self._node, name, kind)
            dds = (participant, topic, self._waitset)
            self._inward[name] = DdsToZenohRoute(dds, self._node, name, InterfaceType.of(kind), self.rejected)
        self._outward[name].update(endpoints.publishers, bool(endpoints.readers))
        self._inward[name].update(endpoints.writers, endpoints.subscriptions)
        self._subscribers[name] = [subscriber.node.full_name for subscriber in endpoints.subscriptions]

    def _close_route(self, name: str) -> None:
        for routes in (self._outward, self._inward):
            if name in routes:
                self._guarded(routes.pop(name).close)
        self._kinds.pop(name, None)
        self._subscribers.pop(name, None)

    def _topic(self, name: str, kind: type[Message]) -> Any:
        """Return the DDS topic of a name and type; readers and writers share it."""
        key = (name, kind)
        if key not in self._topics:
            self._topics[key] = Topic(self._place.participant, TOPIC_PREFIX + name, sample_type(kind))
        return self._topics[key]

    def _publish_nodes(self) -> None:
        readers: dict[str, list[bytes]] = {}
        writers: dict[str, list[bytes]] = {}
        for route in self._outward.values():
            for owner, gid in route.gids():
                writers.setdefault(owner, []).append(gid)
        for name, inward in self._inward.items():
            if inward.gid is not None:
                for owner in dict.fromkeys(self._subscribers[name]):
                    readers.setdefault(owner, []).append(inward.gid)
        others = [node for node in self._wire.graph.nodes() if node.zid != self._wire.zid]
        self._nodes.publish([*others, self._node.id], readers, writers)

    @staticmethod
    def _directions(
        routes: dict[str, tuple[type[Message], TopicEndpoints]],
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        outward = tuple(name for name, (_, endpoints) in routes.items() if endpoints.publishers)
        inward = tuple(
            name for name, (_, endpoints) in routes.items() if endpoints.writers or endpoints.subscriptions
        )
        return outward, inward
