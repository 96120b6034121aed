"""ROS 2 nodes on DDS: each participant publishes which node has which endpoints, on one topic."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic

from chefbot.msgs.rmw_dds_common import Gid, NodeEntitiesInfo, ParticipantEntitiesInfo
from chefbot.ros2.dds.qos import to_dds_writer
from chefbot.ros2.dds.types import sample, sample_type
from chefbot.ros2.rmw.liveliness import NodeId
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS

TOPIC = "ros_discovery_info"


class NodeAnnouncer:
    """Publishes the nodes of the Zenoh side; the last message is latched for late-joining subscribers."""

    def __init__(self, participant: Any) -> None:
        self._gid = _gid(participant.guid.bytes)
        self._kind = sample_type(ParticipantEntitiesInfo)
        topic = Topic(participant, TOPIC, self._kind)
        self._writer: Any = DataWriter(participant, topic, to_dds_writer(TRANSIENT_LOCAL_QOS))
        self._published = b""

    def publish(
        self,
        nodes: Iterable[NodeId],
        readers: Mapping[str, Iterable[bytes]],
        writers: Mapping[str, Iterable[bytes]],
    ) -> None:
        """Publish the nodes and their endpoints, if anything has changed.

        `readers` and `writers` map full node names to the GIDs of their endpoints.
        """
        names = dict.fromkeys((node.namespace, node.name, node.full_name) for node in nodes)
        entries = tuple(
            NodeEntitiesInfo(namespace, name, _gids(readers.get(full, ())), _gids(writers.get(full, ())))
            for namespace, name, full in sorted(names)
        )
        data = ParticipantEntitiesInfo(self._gid, entries).to_cdr()
        if data != self._published:
            self._published = data
            self._writer.write(sample(self._kind, data))


def _gids(gids: Iterable[bytes]) -> tuple[Gid, ...]:
    return tuple(_gid(gid) for gid in sorted(gids))


def _gid(data: bytes) -> Gid:
    return Gid(np.frombuffer(data, np.uint8))
