"""Who reads and writes what on DDS, as ROS 2 names it."""

from __future__ import annotations

from typing import Any, NamedTuple

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState

from chefbot.ros2.dds.qos import from_dds, type_hash_of
from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.names import WireType, ros_name
from chefbot.ros2.rmw.qos import QoS

TOPIC_PREFIX = "rt"
"""Of every ROS topic's DDS name; services and what is not ROS have others."""
_MOST = 1000


class Remote(NamedTuple):
    """A reader or writer of somebody else."""

    handle: int
    """Cyclone's, by which samples name their writer."""
    writes: bool
    topic: str
    """'/scan'"""
    type: WireType
    """Its hash is empty if it tells none."""
    qos: QoS


class Discovery:
    """Kept up to date by `look`, in the caller's thread. `own`: the participant that is not looked at."""

    def __init__(self, participant: Any) -> None:
        self._own = participant.guid
        self._readers = {
            True: BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
            False: BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
        }
        self._found: dict[int, Remote] = {}

    @property
    def readers(self) -> list[Any]:
        """DDS readers that have data when there is news."""
        return list(self._readers.values())

    def look(self) -> bool:
        """Take the news; whether there were any of ROS topics."""
        changed = False
        for writes, reader in self._readers.items():
            for one in reader.take(_MOST):
                changed |= self._learn(one, writes)
        return changed

    def remotes(self, *, writing: bool) -> list[Remote]:
        """All of them that write, or that read."""
        return [one for one in self._found.values() if one.writes == writing]

    def _learn(self, one: Any, writes: bool) -> bool:
        handle = one.sample_info.instance_handle
        if one.sample_info.instance_state != InstanceState.Alive:
            return self._found.pop(handle, None) is not None
        prefix, slash, name = one.topic_name.partition("/")
        if one.participant_key == self._own or prefix != TOPIC_PREFIX:
            return False
        try:
            kind = WireType(ros_name(one.type_name), type_hash_of(one.qos))
        except WireError:
            return False  # not one of ROS's, whatever its topic is called
        self._found[handle] = Remote(handle, writes, slash + name, kind, from_dds(one.qos))
        return True
