"""One topic from Zenoh to DDS: a DDS writer stands for each publisher."""

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
from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.graph import Endpoint
from chefbot.ros2.rmw.names import WireType, has_byte_array
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos_matching import ask_for
from chefbot.ros2.rmw.subscription import Subscription

EARLY = 16
"""Messages kept of publishers whose tokens have not come yet: a latched one is often said at once and never again."""

ALIGNMENT = 4
"""Bytes; of DDS submessages."""
_REFUSALS = {
    DDSException.DDS_RETCODE_BAD_PARAMETER: "not CDR of its type, DDS does not take it",
    DDSException.DDS_RETCODE_TIMEOUT: "a listener on DDS is too slow, it is lost there",
}


class Outward:
    """A writer a publisher keeps QoS and latched messages each publisher's own, and shows whose it is.

    Zenoh is listened to only while somebody on DDS does, or where something is latched.
    """

    def __init__(self, participant: Any, topic: Any, ends: WireNode, name: str, kind: type[Message]) -> None:
        self._participant, self._topic, self._ends = participant, topic, ends
        self._name, self._kind, self._wire_type = name, kind, WireType.of(kind)
        self._writers: dict[bytes, Any] = {}
        self._owners: dict[bytes, str] = {}
        self._early: deque[tuple[bytes, Attachment]] = deque(maxlen=EARLY)
        self._lock = threading.Lock()
        self._heard: Subscription | None = None

    def gids(self) -> list[tuple[str, bytes]]:
        """The full name of a publisher's node and the GID of its writer on DDS, for each."""
        return [(self._owners[one], writer.guid.bytes) for one, writer in self._writers.items()]

    def update(self, publishers: Iterable[Endpoint], wanted: bool) -> None:
        """Who publishes now, and whether somebody on DDS listens."""
        there = {one.gid: one for one in publishers}
        with self._lock:
            for gid in self._writers.keys() - there.keys():
                del self._writers[gid], self._owners[gid]
            for gid in there.keys() - self._writers.keys():
                qos = to_dds_writer(there[gid].end.qos, self._wire_type.hash)
                self._writers[gid] = DataWriter(self._participant, self._topic, qos)
                self._owners[gid] = there[gid].node.full_name
        self._flush()
        offer = ask_for(one.end.qos for one in there.values())
        self._listen(bool(there) and (wanted or offer.latched), offer)

    def close(self) -> None:
        """Nobody publishes here any more."""
        self.update([], False)

    def _listen(self, wish: bool, offer: Any) -> None:
        if self._heard is not None and (not wish or self._heard.qos != offer):
            self._ends.drop(self._heard)
            self._heard = None
        if wish and self._heard is None:
            buffered = has_byte_array(self._kind) and not offer.latched
            self._heard = self._ends.raw_subscription(
                self._name, self._wire_type, self._receive, offer, buffered=buffered
            )

    def _flush(self) -> None:
        """What came before its publisher was known."""
        for _ in range(len(self._early)):
            with contextlib.suppress(WireError, CdrError):  # one that never was a message of this type
                self._receive(*self._early.popleft())

    def _receive(self, cdr: bytes, attachment: Attachment) -> None:
        """In Zenoh's thread; WireError or CdrError, which the subscription counts, when DDS does not take it."""
        with self._lock:
            writer = self._writers.get(attachment.gid)
            if writer is None:
                self._early.append((cdr, attachment))
                return
        if len(cdr) % ALIGNMENT:  # Cyclone fills it up with zeros: what was cut off would not be missed
            self._kind.from_cdr(cdr)
        try:
            writer.write(sample(writer.data_type, cdr), attachment.stamp_ns)
        except DDSException as error:
            raise WireError(_REFUSALS.get(error.code, f"DDS does not take it: {error.msg}")) from None
