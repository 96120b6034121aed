"""Who meets on a topic, on both sides, and of which type they are."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.ros2.dds.discovery import Discovery, Remote
from chefbot.ros2.rmw.graph import Endpoint
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.qos import incompatible
from chefbot.ros2.rmw.session import Wire


class Crowd(NamedTuple):
    """All ends of one topic but the bridge's own."""

    publishers: tuple[Endpoint, ...] = ()
    """On Zenoh."""
    listeners: tuple[Endpoint, ...] = ()
    """On Zenoh."""
    writers: tuple[Remote, ...] = ()
    """On DDS."""
    readers: tuple[Remote, ...] = ()
    """On DDS."""

    @property
    def types(self) -> list[WireType]:
        """Each once, Zenoh's first: there are the robot's."""
        ours = [one.end.type for one in (*self.publishers, *self.listeners)]
        return list(dict.fromkeys([*ours, *(one.type for one in (*self.writers, *self.readers))]))

    def of_type(self, kind: WireType) -> Crowd:
        """Those who have this type, or on DDS at least its name and no hash."""
        return Crowd(
            tuple(one for one in self.publishers if one.end.type == kind),
            tuple(one for one in self.listeners if one.end.type == kind),
            tuple(one for one in self.writers if same(one.type, kind)),
            tuple(one for one in self.readers if same(one.type, kind)),
        )


def gather(wire: Wire, discovery: Discovery) -> dict[str, Crowd]:
    """By topic; hidden ones, which are the inside of actions and tools, are left alone."""
    named = wire.graph.topics()
    writers, readers = _by_topic(discovery.remotes(writing=True)), _by_topic(discovery.remotes(writing=False))
    found = {}
    for name in sorted(named.keys() | writers.keys() | readers.keys()):
        if "/_" not in name:
            ends = named.get(name)
            publishers = _others(ends.givers, wire) if ends else ()
            listeners = _others(ends.takers, wire) if ends else ()
            found[name] = Crowd(
                publishers, listeners, tuple(writers.get(name, ())), tuple(readers.get(name, ()))
            )
    return found


def choose_type(crowd: Crowd) -> tuple[type[Message] | None, str]:
    """The type in which the topic is copied, None if there is none; and what is not copied, and why."""
    known = [(kind, own) for kind in crowd.types if (own := _known(kind)) is not None]
    others = [one.name for one in crowd.types if not known or not same(one, known[0][0])]
    if not known:
        return None, f"chefbot has no definition of {' or '.join(dict.fromkeys(others))} in this version"
    chosen, own = known[0]
    if not others:
        return own, ""
    return own, f"copied as {chosen.name} only; some have {' and '.join(others)}, or another version of it"


def unheard(crowd: Crowd) -> str:
    """Which publishers a reader on DDS cannot hear and why; empty if all are heard."""
    reasons = {
        f"{publisher.node.full_name} is not heard by a reader on DDS: {reason}"
        for publisher in crowd.publishers
        for reader in crowd.readers
        for reason in incompatible(publisher.end.qos, reader.qos)
    }
    return "; ".join(sorted(reasons))


def same(one: WireType, other: WireType) -> bool:
    """Equal, where both tell a hash."""
    return one.name == other.name and (one.hash == other.hash or not (one.hash and other.hash))


def _known(kind: WireType) -> type[Message] | None:
    try:
        own = message_type(kind.name)
    except KeyError:
        return None
    return own if same(WireType.of(own), kind) else None


def _others(ends: Iterable[Endpoint], wire: Wire) -> tuple[Endpoint, ...]:
    return tuple(one for one in ends if one.node.zid != wire.zid)


def _by_topic(remotes: Iterable[Remote]) -> dict[str, list[Remote]]:
    found: dict[str, list[Remote]] = {}
    for one in remotes:
        found.setdefault(one.topic, []).append(one)
    return found
