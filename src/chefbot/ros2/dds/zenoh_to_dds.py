"""A route for one topic from Zenoh to DDS, with a DDS writer for each publisher."""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from collections.abc import Iterable
from typing import Any

from cyclonedds.core import DDSException
from cyclonedds.pub import DataWriter

from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.message import Message
from chefbot.ros2.dds.qos import to_dds_writer
from chefbot.ros2.dds.types import sample
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.graph import Endpoint
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos_matching import best_matching_qos
from chefbot.ros2.rmw.subscription import Subscription

MAX_PENDING = 16
"""Messages kept for publishers whose tokens have not arrived yet: a latched one is often published only once."""

ALIGNMENT = 4
"""Alignment of DDS submessages, bytes."""
_REFUSALS = {
    DDSException.DDS_RETCODE_BAD_PARAMETER: "not CDR of its type, DDS does not take it",
    DDSException.DDS_RETCODE_TIMEOUT: "a reader on DDS is too slow, the message is lost there",
}


class ZenohToDdsRoute:
    """A route from Zenoh to DDS.

    One writer per publisher preserves each publisher's QoS and latched messages, and shows its node. The
    topic is subscribed to on Zenoh only while there is a DDS reader, or for latched topics.
    """

    def __init__(self, participant: Any, topic: Any, node: RmwNode, name: str, kind: type[Message]) -> None:
        self._participant, self._topic, self._node = participant, topic, node
        self._name, self._kind, self._wire_type = name, kind, InterfaceType.of(kind)
        self._writers: dict[bytes, Any] = {}
        self._owners: dict[bytes, str] = {}
        self._early: deque[tuple[bytes, Attachment]] = deque(maxlen=MAX_PENDING)
        self._lock = threading.Lock()
        self._subscription: Subscription | None = None

    def gids(self) -> list[tuple[str, bytes]]:
        """Return the full node name of each publisher with the GID of its DDS writer."""
        return [(self._owners[gid], writer.guid.bytes) for gid, writer in self._writers.items()]

    def update(self, publishers: Iterable[Endpoint], has_readers: bool) -> None:
        """Update the writers for the current publishers.

        The topic is subscribed to on Zenoh if it has readers on DDS, or is latched.
        """
        # One DDS writer per publisher
        current = {publisher.gid: publisher for publisher in publishers}
        with self._lock:
            for gid in self._writers.keys() - current.keys():
                del self._writers[gid], self._owners[gid]
            for gid in current.keys() - self._writers.keys():
                qos = to_dds_writer(current[gid].info.qos, self._wire_type.hash)
                self._writers[gid] = DataWriter(self._participant, self._topic, qos)
                self._owners[gid] = current[gid].node.full_name
        self._flush()
        offer = best_matching_qos(publisher.info.qos for publisher in current.values())
        self._set_subscription(bool(current) and (has_readers or offer.latched), offer)

    def close(self) -> None:
        """Delete the writers and the subscription."""
        self.update([], False)

    def _set_subscription(self, subscribed: bool, qos: Any) -> None:
        if self._subscription is not None and (not subscribed or self._subscription.qos != qos):
            self._node.destroy(self._subscription)
            self._subscription = None
        if subscribed and self._subscription is None:
            self._subscription = self._node.raw_subscription(self._name, self._wire_type, self._receive, qos)

    def _flush(self) -> None:
        """Forward the messages that arrived before their publisher was known."""
        for _ in range(len(self._early)):
            with contextlib.suppress(RmwError, CdrError):  # it was not a valid message of this type
                self._receive(*self._early.popleft())

    def _receive(self, cdr: bytes, attachment: Attachment) -> None:
        """Write a message to DDS; called in a Zenoh thread.

        Raises RmwError or CdrError, which the subscription counts, when DDS does not accept it.
        """
        with self._lock:
            writer = self._writers.get(attachment.gid)
            if writer is None:
                self._early.append((cdr, attachment))
                return
        if len(cdr) % ALIGNMENT:  # Cyclone pads with zeros and would hide a truncated message
            self._kind.from_cdr(cdr)
        try:
            writer.write(sample(writer.data_type, cdr), attachment.stamp_ns)
        except DDSException as error:
            raise RmwError(_REFUSALS.get(error.code, f"DDS does not take it: {error.msg}")) from None
