"""One topic from DDS to Zenoh: one DDS reader, and a Zenoh publisher for each DDS writer."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.sub import DataReader

from chefbot.msgs.idl.cdr import HEADER
from chefbot.ros2.dds.discovery import Remote
from chefbot.ros2.dds.qos import to_dds
from chefbot.ros2.rmw.errors import Tally
from chefbot.ros2.rmw.graph import Endpoint
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import BEST_EFFORT, DEFAULT, RELIABLE, TRANSIENT_LOCAL, VOLATILE, QoS
from chefbot.ros2.rmw.qos_matching import ask_for

AT_ONCE = 64
"""Samples that one topic may hand over before another has its turn."""
_PLAIN = HEADER[:2]
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any


class Inward:
    """The reader is there while somebody on Zenoh listens, whether or not anybody on DDS speaks: so it is seen.

    `waiting`: what wakes the bridge when samples have come.
    """

    def __init__(
        self, place: tuple[Any, Any, Any], ends: WireNode, name: str, kind: WireType, tally: Tally
    ) -> None:
        self._participant, self._topic, self._waiting = place
        self._ends, self._name, self._kind, self._tally = ends, name, kind, tally
        self._publishers: dict[int, Publisher[Any]] = {}
        self._reader: Any = None
        self._condition: Any = None
        self._asked: QoS | None = None
        self._unmatched: set[int] = set()
        self._early: deque[Any] = deque(maxlen=AT_ONCE)
        """Samples whose writer's publisher has not been made yet: a goal is often said once, at once."""

    @property
    def gid(self) -> bytes | None:
        """Of the reader, while there is one."""
        return None if self._reader is None else self._reader.guid.bytes

    def update(self, writers: Iterable[Remote], listeners: Iterable[Endpoint]) -> None:
        """Who writes on DDS and who listens on Zenoh now."""
        there = {one.handle: one for one in writers}
        for handle in self._publishers.keys() - there.keys():
            self._ends.drop(self._publishers.pop(handle))
        for handle in there.keys() - self._publishers.keys():
            qos = _told_depth(there[handle].qos)
            self._publishers[handle] = self._ends.raw_publisher(self._name, self._kind, qos)
        for _ in range(len(self._early)):
            self._hand_over(self._early.popleft(), known=True)
        asked = [one.end.qos for one in listeners]
        self._read(_reader_qos(asked, [one.qos for one in there.values()]) if asked else None)

    def close(self) -> None:
        """Nobody is here any more."""
        self.update([], [])

    def copy(self) -> bool:
        """Hand over what has come; whether there may be more."""
        if self._reader is None:
            return False
        samples = self._reader.take(AT_ONCE)
        for one in samples:
            if one.sample_info.valid_data:
                self._hand_over(one)
        return len(samples) == AT_ONCE

    def deaf(self) -> str:
        """Why a writer that is there is not heard; empty if all are. To be asked now and then, not at once."""
        matched = set() if self._reader is None else set(self._reader.get_matched_publications())
        unmatched = set() if self._reader is None else self._publishers.keys() - matched
        lasting, self._unmatched = unmatched & self._unmatched, unmatched
        return (
            "a writer on DDS has other fields in its type, or other QoS, and is not heard" if lasting else ""
        )

    def _hand_over(self, sample: Any, *, known: bool = False) -> None:
        """`known`: whoever is there has a publisher by now."""
        publisher = self._publishers.get(sample.sample_info.publication_handle)
        cdr = sample.cdr
        if publisher is None and not known:
            self._early.append(sample)
        elif publisher is None:
            self._tally.add(f"{self._name}: its writer on DDS is gone, or of another type")
        elif cdr[:2] != _PLAIN:
            self._tally.add(
                f"{self._name}: a message from DDS that is not little-endian CDR of the first version"
            )
        else:
            # Cyclone notes the padding at the end in the header's last byte; ROS 2 has zero there
            publisher.publish_cdr(cdr if cdr[:4] == HEADER else HEADER + cdr[4:])

    def _read(self, asked: QoS | None) -> None:
        if asked == self._asked:
            return
        if self._reader is not None:
            self._waiting.detach(self._condition)
            self._condition = self._reader = None
        self._asked = asked
        if asked is not None:
            self._reader = DataReader(self._participant, self._topic, to_dds(asked, self._kind.hash))
            self._condition = ReadCondition(self._reader, _ANY)
            self._waiting.attach(self._condition)


def _reader_qos(asked: list[QoS], offered: list[QoS]) -> QoS:
    """What the listeners ask for, or as much of it as all writers there offer: nobody is left unheard.

    Without reason it does not change, since a reader made anew misses what is said meanwhile.
    """
    least = ask_for(offered)
    reliable = any(one.reliable for one in asked) and least.reliable
    latched = any(one.latched for one in asked) and (least.latched or not offered)
    depth = max(AT_ONCE, *(one.depth for one in asked))  # room for a moment in which the bridge has no turn
    return QoS(
        reliability=RELIABLE if reliable else BEST_EFFORT,
        durability=TRANSIENT_LOCAL if latched else VOLATILE,
        depth=depth,
    )


def _told_depth(qos: QoS) -> QoS:
    """DDS tells nobody how much a writer keeps; for latched topics what is usual is assumed."""
    return QoS(reliability=qos.reliability, durability=qos.durability, depth=max(qos.depth, DEFAULT.depth))
