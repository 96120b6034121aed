"""Nodes on DDS: ROS 2 has one topic on which each participant tells which node has which ends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic

from chefbot.msgs.rmw_dds_common import Gid, NodeEntitiesInfo, ParticipantEntitiesInfo
from chefbot.ros2.dds.qos import to_dds_writer
from chefbot.ros2.dds.types import sample, sample_type
from chefbot.ros2.rmw.qos import LATCHED
from chefbot.ros2.rmw.tokens import NodeId

TOPIC = "ros_discovery_info"


class Nodes:
    """Tells of nodes; what was told last is there for latecomers."""

    def __init__(self, participant: Any) -> None:
        self._gid = _gid(participant.guid.bytes)
        self._kind = sample_type(ParticipantEntitiesInfo)
        topic = Topic(participant, TOPIC, self._kind)
        self._writer: Any = DataWriter(participant, topic, to_dds_writer(LATCHED))
        self._told = b""

    def tell(
        self,
        nodes: Iterable[NodeId],
        readers: Mapping[str, Iterable[bytes]],
        writers: Mapping[str, Iterable[bytes]],
    ) -> None:
        """`readers` and `writers`: full names of nodes to GIDs of what they have. Nothing new is not told again."""
        names = dict.fromkeys((one.namespace, one.name, one.full_name) for one in nodes)
        entries = tuple(
            NodeEntitiesInfo(namespace, name, _gids(readers.get(full, ())), _gids(writers.get(full, ())))
            for namespace, name, full in sorted(names)
        )
        told = ParticipantEntitiesInfo(self._gid, entries).to_cdr()
        if told != self._told:
            self._told = told
            self._writer.write(sample(self._kind, told))


def _gids(them: Iterable[bytes]) -> tuple[Gid, ...]:
    return tuple(_gid(one) for one in sorted(them))


def _gid(data: bytes) -> Gid:
    return Gid(np.frombuffer(data, np.uint8))
