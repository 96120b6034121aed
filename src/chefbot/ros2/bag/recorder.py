"""Recording what is said on the wire, bytes as they are, of any type."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from chefbot.msgs.idl.registry import message_type
from chefbot.ros2.bag.writer import BagWriter
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.graph import Named
from chefbot.ros2.rmw.names import WireType, has_byte_array
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos_matching import ask_for, types_said
from chefbot.ros2.rmw.subscription import Receive

FLUSH_PERIOD = 1.0
"""Seconds; so much a recording loses at most when its process is killed."""
MAX_WAITING = 200_000_000
"""Bytes that may wait for a slow disk; what comes beyond is counted as lost."""
_Sample = tuple[str, WireType, bytes, int, int]


class BagRecorder:
    """Writes all of the topics that `wants(name)`, also of those that appear later."""

    def __init__(self, node: WireNode, writer: BagWriter, wants: Callable[[str], bool]) -> None:
        self.lost: dict[str, int] = {}
        """Messages for which the disk was too slow, by topic."""
        self._node, self._writer, self._wants = node, writer, wants
        self._heard: set[tuple[str, WireType]] = set()
        self._waiting: deque[_Sample] = deque()
        self._bytes = 0
        self._lock = threading.Lock()
        self._changed = threading.Event()
        self._changed.set()
        self._wake = threading.Event()
        node.wire.graph.on_change(self._changed.set)

    def run(self, seconds: float | None, stop: threading.Event) -> None:
        """For so long, or until `stop` is set. UserError when the disk is full."""
        now = time.monotonic()
        until, flush_at = (None if seconds is None else now + seconds), now + FLUSH_PERIOD
        while not stop.is_set() and (until is None or time.monotonic() < until):
            if self._changed.is_set():
                self._changed.clear()
                self._subscribe()
            self._wake.wait(0.05)
            self._wake.clear()
            self.write_waiting()
            if time.monotonic() >= flush_at:
                self._writer.flush()
                flush_at = time.monotonic() + FLUSH_PERIOD

    def write_waiting(self) -> None:
        """Empty the queue."""
        while self._waiting:
            topic, kind, data, heard, said = self._waiting.popleft()
            with self._lock:
                self._bytes -= len(data)
            self._writer.add(topic, kind, data, heard, said)

    def _subscribe(self) -> None:
        """To what is new."""
        for name, named in self._node.wire.graph.topics().items():
            if named.givers and self._wants(name):
                for kind in types_said(named):
                    if (name, kind) not in self._heard:
                        self._listen(named, kind)

    def _listen(self, named: Named, kind: WireType) -> None:
        self._heard.add((named.name, kind))
        offers = [one.end.qos for one in named.givers if one.end.type == kind]
        self._writer.add_topic(named.name, kind, offers)
        asked = ask_for(offers)
        buffered = not asked.latched and maybe_buffered(kind)
        self._node.raw_subscription(
            named.name, kind, self._keeper(named.name, kind), asked, buffered=buffered
        )

    def _keeper(self, topic: str, kind: WireType) -> Receive:
        def keep(data: bytes, attachment: Attachment) -> None:
            with self._lock:
                if self._bytes + len(data) > MAX_WAITING:
                    self.lost[topic] = self.lost.get(topic, 0) + 1
                    return
                self._bytes += len(data)
            self._waiting.append((topic, kind, data, time.time_ns(), attachment.stamp_ns))
            self._wake.set()

        return keep


def maybe_buffered(kind: WireType) -> bool:
    """Whether newer rmw_zenoh may send this type by buffers; of types that we do not have it is assumed."""
    try:
        return has_byte_array(message_type(kind.name))
    except KeyError:
        return True
