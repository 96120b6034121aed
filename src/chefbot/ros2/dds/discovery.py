"""Discovery of DDS readers and writers of ROS topics."""

from __future__ import annotations

from typing import Any, NamedTuple

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState

from chefbot.ros2.dds.qos import from_dds, type_hash_of
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.names import InterfaceType, ros_name
from chefbot.ros2.rmw.qos import QoS

TOPIC_PREFIX = "rt"
"""Prefix of a ROS topic's DDS name; services and other DDS topics have others."""
_MAX_SAMPLES = 1000


class RemoteEndpoint(NamedTuple):
    """A DDS reader or writer of another participant."""

    handle: int
    """Cyclone's instance handle, by which samples identify their writer."""
    writes: bool
    topic: str
    """ROS name of the topic, such as '/scan'."""
    type: InterfaceType
    """Message type; its hash is empty if the endpoint announces none."""
    qos: QoS


class Discovery:
    """The readers and writers of other participants, updated by `update` in the caller's thread."""

    def __init__(self, participant: Any) -> None:
        self._own = participant.guid
        self._readers = {
            True: BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
            False: BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
        }
        self._remotes: dict[int, RemoteEndpoint] = {}

    @property
    def readers(self) -> list[Any]:
        """DDS readers that have data when endpoints have appeared or disappeared."""
        return list(self._readers.values())

    def update(self) -> bool:
        """Process discovery updates; return whether any concerned ROS topics."""
        changed = False
        for writes, reader in self._readers.items():
            for sample in reader.take(_MAX_SAMPLES):
                changed |= self._update(sample, writes)
        return changed

    def remotes(self, *, writing: bool) -> list[RemoteEndpoint]:
        """Return all discovered writers, or all readers."""
        return [remote for remote in self._remotes.values() if remote.writes == writing]

    def _update(self, sample: Any, writes: bool) -> bool:
        handle = sample.sample_info.instance_handle
        if sample.sample_info.instance_state != InstanceState.Alive:
            return self._remotes.pop(handle, None) is not None
        prefix, slash, name = sample.topic_name.partition("/")
        if sample.participant_key == self._own or prefix != TOPIC_PREFIX:
            return False
        try:
            kind = InterfaceType(ros_name(sample.type_name), type_hash_of(sample.qos))
        except RmwError:
            return False  # no ROS type, despite the topic's prefix
        self._remotes[handle] = RemoteEndpoint(handle, writes, slash + name, kind, from_dds(sample.qos))
        return True
