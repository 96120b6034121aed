"""A route for one topic from DDS to Zenoh: one DDS reader, and a Zenoh publisher for each DDS writer."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.sub import DataReader

from chefbot.msgs.idl.cdr import HEADER
from chefbot.ros2.dds.discovery import RemoteEndpoint
from chefbot.ros2.dds.qos import to_dds
from chefbot.ros2.rmw.errors import ErrorCounter
from chefbot.ros2.rmw.graph import Endpoint
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import BEST_EFFORT, DEFAULT, RELIABLE, TRANSIENT_LOCAL, VOLATILE, QoS
from chefbot.ros2.rmw.qos_matching import best_matching_qos

MAX_SAMPLES_PER_TURN = 64
"""Maximum number of samples copied per turn, so that other topics are not delayed."""
_PLAIN = HEADER[:2]
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any


class DdsToZenohRoute:
    """A route from DDS to Zenoh.

    The DDS reader exists while there is a subscriber on Zenoh, even without a DDS writer, so that ROS 2 tools
    see it. `dds` holds the participant, the DDS topic and the wait set that wakes the bridge for new samples.
    """

    def __init__(
        self, dds: tuple[Any, Any, Any], node: RmwNode, name: str, kind: InterfaceType, tally: ErrorCounter
    ) -> None:
        self._participant, self._topic, self._waitset = dds
        self._node, self._name, self._kind, self._tally = node, name, kind, tally
        self._publishers: dict[int, Publisher[Any]] = {}
        self._reader: Any = None
        self._condition: Any = None
        self._qos: QoS | None = None
        self._unmatched: set[int] = set()
        self._early: deque[Any] = deque(maxlen=MAX_SAMPLES_PER_TURN)
        """Samples whose publisher does not exist yet: a goal is often published once, right after its writer
        appears."""

    @property
    def gid(self) -> bytes | None:
        """GID of the DDS reader, if there is one."""
        return None if self._reader is None else self._reader.guid.bytes

    def update(self, writers: Iterable[RemoteEndpoint], subscribers: Iterable[Endpoint]) -> None:
        """Update the publishers and the reader for the current DDS writers and Zenoh subscribers."""
        # One publisher per DDS writer
        current = {writer.handle: writer for writer in writers}
        for handle in self._publishers.keys() - current.keys():
            self._node.destroy(self._publishers.pop(handle))
        for handle in current.keys() - self._publishers.keys():
            qos = _assume_depth(current[handle].qos)
            self._publishers[handle] = self._node.raw_publisher(self._name, self._kind, qos)
        # Publish the samples that arrived before their publisher existed
        for _ in range(len(self._early)):
            self._publish_sample(self._early.popleft(), matched=True)
        requested = [subscriber.info.qos for subscriber in subscribers]
        self._set_reader(
            _reader_qos(requested, [writer.qos for writer in current.values()]) if requested else None
        )

    def close(self) -> None:
        """Delete the DDS reader and the publishers."""
        self.update([], [])

    def copy(self) -> bool:
        """Copy new samples to Zenoh; return whether there may be more."""
        if self._reader is None:
            return False
        samples = self._reader.take(MAX_SAMPLES_PER_TURN)
        for sample in samples:
            if sample.sample_info.valid_data:
                self._publish_sample(sample)
        return len(samples) == MAX_SAMPLES_PER_TURN

    def unmatched_reason(self) -> str:
        """Return why an existing writer is not matched; empty if all are.

        A writer counts as unmatched only if it was so at the previous call too; call it periodically.
        """
        matched = set() if self._reader is None else set(self._reader.get_matched_publications())
        unmatched = set() if self._reader is None else self._publishers.keys() - matched
        still_unmatched, self._unmatched = unmatched & self._unmatched, unmatched
        if not still_unmatched:
            return ""
        return "a writer on DDS has other fields in its type, or other QoS, and does not match"

    def _publish_sample(self, sample: Any, *, matched: bool = False) -> None:
        """Publish one sample; with `matched` all current writers have their publishers."""
        publisher = self._publishers.get(sample.sample_info.publication_handle)
        cdr = sample.cdr
        if publisher is None and not matched:
            self._early.append(sample)
        elif publisher is None:
            self._tally.add(f"{self._name}: its writer on DDS is gone, or of another type")
        elif cdr[:2] != _PLAIN:
            self._tally.add(
                f"{self._name}: a message from DDS that is not little-endian CDR of the first version"
            )
        else:
            # Cyclone stores the length of the trailing padding in the header's last byte; ROS 2 has zero there
            publisher.publish_cdr(cdr if cdr[:4] == HEADER else HEADER + cdr[4:])

    def _set_reader(self, qos: QoS | None) -> None:
        if qos == self._qos:
            return
        if self._reader is not None:
            self._waitset.detach(self._condition)
            self._condition = self._reader = None
        self._qos = qos
        if qos is not None:
            self._reader = DataReader(self._participant, self._topic, to_dds(qos, self._kind.hash))
            self._condition = ReadCondition(self._reader, _ANY)
            self._waitset.attach(self._condition)


def _reader_qos(requested: list[QoS], offered: list[QoS]) -> QoS:
    """Return the QoS that the subscribers request, weakened to what all existing writers offer.

    Thus no writer is left unmatched. It stays the same where possible, since a new reader misses the messages
    published meanwhile.
    """
    offer = best_matching_qos(offered)
    reliable = any(qos.reliable for qos in requested) and offer.reliable
    latched = any(qos.latched for qos in requested) and (offer.latched or not offered)
    # deep enough to buffer samples while the bridge serves other topics
    depth = max(MAX_SAMPLES_PER_TURN, *(qos.depth for qos in requested))
    return QoS(
        reliability=RELIABLE if reliable else BEST_EFFORT,
        durability=TRANSIENT_LOCAL if latched else VOLATILE,
        depth=depth,
    )


def _assume_depth(qos: QoS) -> QoS:
    """Return the QoS with at least the default depth; DDS does not announce a writer's history depth."""
    return QoS(reliability=qos.reliability, durability=qos.durability, depth=max(qos.depth, DEFAULT.depth))
