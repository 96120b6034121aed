"""The endpoints of a topic on both sides of the bridge, and their types."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.ros2.dds.discovery import Discovery, RemoteEndpoint
from chefbot.ros2.rmw.graph import Endpoint
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.qos import incompatible
from chefbot.ros2.rmw.session import RmwContext


class TopicEndpoints(NamedTuple):
    """All endpoints of one topic except the bridge's own."""

    publishers: tuple[Endpoint, ...] = ()
    """Publishers on Zenoh."""
    subscriptions: tuple[Endpoint, ...] = ()
    """Subscriptions on Zenoh."""
    writers: tuple[RemoteEndpoint, ...] = ()
    """Writers on DDS."""
    readers: tuple[RemoteEndpoint, ...] = ()
    """Readers on DDS."""

    @property
    def types(self) -> list[InterfaceType]:
        """The distinct types of the endpoints; those on Zenoh, the robot's, come first."""
        zenoh = [endpoint.info.type for endpoint in (*self.publishers, *self.subscriptions)]
        return list(dict.fromkeys([*zenoh, *(remote.type for remote in (*self.writers, *self.readers))]))

    def of_type(self, kind: InterfaceType) -> TopicEndpoints:
        """Return the endpoints of a type; DDS endpoints without a hash match by name."""
        return TopicEndpoints(
            tuple(publisher for publisher in self.publishers if publisher.info.type == kind),
            tuple(subscriber for subscriber in self.subscriptions if subscriber.info.type == kind),
            tuple(writer for writer in self.writers if same_type(writer.type, kind)),
            tuple(reader for reader in self.readers if same_type(reader.type, kind)),
        )


def endpoints_by_topic(wire: RmwContext, discovery: Discovery) -> dict[str, TopicEndpoints]:
    """Return the endpoints of each topic by name.

    Hidden topics, which belong to actions and tools, are left out.
    """
    zenoh = wire.graph.topics()
    writers, readers = _by_topic(discovery.remotes(writing=True)), _by_topic(discovery.remotes(writing=False))
    topics = {}
    for name in sorted(zenoh.keys() | writers.keys() | readers.keys()):
        if "/_" not in name:
            endpoints = zenoh.get(name)
            publishers = _without_own(endpoints.providers, wire) if endpoints else ()
            subscribers = _without_own(endpoints.consumers, wire) if endpoints else ()
            topics[name] = TopicEndpoints(
                publishers, subscribers, tuple(writers.get(name, ())), tuple(readers.get(name, ()))
            )
    return topics


def choose_type(endpoints: TopicEndpoints) -> tuple[type[Message] | None, str]:
    """Return the type in which a topic is bridged, None if there is none.

    The second value is a sentence on what is not bridged and why; empty if everything is.
    """
    known = [(kind, message) for kind in endpoints.types if (message := _message_class(kind)) is not None]
    others = [kind.name for kind in endpoints.types if not known or not same_type(kind, known[0][0])]
    if not known:
        return None, f"chefbot has no definition of {' or '.join(dict.fromkeys(others))} in this version"
    chosen, message = known[0]
    if not others:
        return message, ""
    return (
        message,
        f"copied as {chosen.name} only; some have {' and '.join(others)}, or another version of it",
    )


def unmatched_publishers(endpoints: TopicEndpoints) -> str:
    """Return which publishers a DDS reader cannot match and why; empty if all match."""
    reasons = {
        f"{publisher.node.full_name} does not match a reader on DDS: {reason}"
        for publisher in endpoints.publishers
        for reader in endpoints.readers
        for reason in incompatible(publisher.info.qos, reader.qos)
    }
    return "; ".join(sorted(reasons))


def same_type(first: InterfaceType, second: InterfaceType) -> bool:
    """Return whether two types have the same name and, where both have a hash, the same hash."""
    return first.name == second.name and (first.hash == second.hash or not (first.hash and second.hash))


def _message_class(kind: InterfaceType) -> type[Message] | None:
    try:
        message = message_type(kind.name)
    except KeyError:
        return None
    return message if same_type(InterfaceType.of(message), kind) else None


def _without_own(endpoints: Iterable[Endpoint], wire: RmwContext) -> tuple[Endpoint, ...]:
    return tuple(endpoint for endpoint in endpoints if endpoint.node.zid != wire.zid)


def _by_topic(remotes: Iterable[RemoteEndpoint]) -> dict[str, list[RemoteEndpoint]]:
    found: dict[str, list[RemoteEndpoint]] = {}
    for remote in remotes:
        found.setdefault(remote.topic, []).append(remote)
    return found
