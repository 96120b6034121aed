"""Recording of topics of any type as raw CDR bytes."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from chefbot.ros2.bag.writer import BagWriter
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.graph import EndpointGroup
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos_matching import best_matching_qos, offered_types
from chefbot.ros2.rmw.subscription import SampleCallback

FLUSH_PERIOD = 1.0
"""Seconds between flushes, and so the most that is lost when the process is killed."""
MAX_QUEUED_BYTES = 200_000_000
"""Maximum bytes queued for a slow disk; further messages are counted as lost."""
_Sample = tuple[str, InterfaceType, bytes, int, int]


class BagRecorder:
    """A recorder of all topics for which `wants(name)` holds, including topics that appear later."""

    def __init__(self, node: RmwNode, writer: BagWriter, wants: Callable[[str], bool]) -> None:
        self.dropped: dict[str, int] = {}
        """Messages lost because the disk was too slow, by topic."""
        self._node, self._writer, self._wants = node, writer, wants
        self._subscribed: set[tuple[str, InterfaceType]] = set()
        self._waiting: deque[_Sample] = deque()
        self._bytes = 0
        self._lock = threading.Lock()
        self._changed = threading.Event()
        self._changed.set()
        self._wake = threading.Event()
        node.wire.graph.on_change(self._changed.set)

    def run(self, seconds: float | None, stop: threading.Event) -> None:
        """Record for `seconds`, or until `stop` is set.

        Raises StorageError when the disk is full.
        """
        now = time.monotonic()
        deadline, flush_at = (None if seconds is None else now + seconds), now + FLUSH_PERIOD
        while not stop.is_set() and (deadline is None or time.monotonic() < deadline):
            # Subscribe to topics that appeared since the last turn
            if self._changed.is_set():
                self._changed.clear()
                self._subscribe()
            # Write what the Zenoh threads have queued; the disk must not block them
            self._wake.wait(0.05)
            self._wake.clear()
            self.write_queued()
            if time.monotonic() >= flush_at:
                self._writer.flush()
                flush_at = time.monotonic() + FLUSH_PERIOD

    def write_queued(self) -> None:
        """Write all queued messages to the bag."""
        while self._waiting:
            topic, kind, data, received_ns, published_ns = self._waiting.popleft()
            with self._lock:
                self._bytes -= len(data)
            self._writer.add(topic, kind, data, received_ns, published_ns)

    def _subscribe(self) -> None:
        """Subscribe to the wanted topics and types that have appeared."""
        for name, topic in self._node.wire.graph.topics().items():
            if topic.providers and self._wants(name):
                for kind in offered_types(topic):
                    if (name, kind) not in self._subscribed:
                        self._subscribe_to(topic, kind)

    def _subscribe_to(self, topic: EndpointGroup, kind: InterfaceType) -> None:
        self._subscribed.add((topic.name, kind))
        offers = [endpoint.info.qos for endpoint in topic.providers if endpoint.info.type == kind]
        self._writer.add_topic(topic.name, kind, offers)
        qos = best_matching_qos(offers)
        self._node.raw_subscription(topic.name, kind, self._queue_callback(topic.name, kind), qos)

    def _queue_callback(self, topic: str, kind: InterfaceType) -> SampleCallback:
        def enqueue(data: bytes, attachment: Attachment) -> None:
            with self._lock:
                if self._bytes + len(data) > MAX_QUEUED_BYTES:
                    self.dropped[topic] = self.dropped.get(topic, 0) + 1
                    return
                self._bytes += len(data)
            self._waiting.append((topic, kind, data, time.time_ns(), attachment.stamp_ns))
            self._wake.set()

        return enqueue
