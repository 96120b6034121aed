"""Inbox from the wire's threads to the loop: bounded, rate-limited, and in the loop's total order."""

from __future__ import annotations

import threading
from collections import deque
from functools import partial

from chefbot.msgs.idl.message import Message
from chefbot.ros2.rmw.errors import QUEUE_FULL, ErrorCounter
from chefbot.runtime.loop import DEVICE, Loop

WIRE_PUBLISHER = "wire"
"""Publisher name in the loop of received messages; a replay publishes them, like those of devices."""
DEPTH = 10
"""Default queue depth of a topic, messages."""
PAUSE_NS = 10_000_000
"""Time between two deliveries on one topic, ns: a flood costs the loop at most DEPTH messages in this
time."""


class Inbox:
    """A thread-safe inbox; the loop publishes each message as a device's message at an instant of its own."""

    def __init__(self, loop: Loop, dropped: ErrorCounter) -> None:
        self._loop = loop
        self._dropped = dropped
        self._waiting: dict[str, deque[tuple[Message, bool]]] = {}
        self._lock = threading.Lock()

    def publish(self, topic: str, message: Message, *, latched: bool = False, depth: int = DEPTH) -> None:
        """Publish the message in the loop soon; a queue of `depth` messages drops its oldest."""
        with self._lock:
            queue = self._waiting.get(topic)
            if queue is not None:  # a delivery is scheduled already
                if len(queue) >= depth:
                    queue.popleft()
                    self._dropped.add(f"/{topic}: receive {QUEUE_FULL}")
                queue.append((message, latched))
                return
            self._waiting[topic] = deque([(message, latched)])
        self._loop.post(partial(self._deliver, topic))

    def _deliver(self, topic: str) -> None:
        """Publish all that is queued on a topic, and repeat after the pause until the queue is empty."""
        with self._lock:
            waiting = list(self._waiting[topic])
            self._waiting[topic].clear()
            if not waiting:
                del self._waiting[topic]
                return
        for message, latched in waiting:
            self._loop.publish(topic, message, WIRE_PUBLISHER, from_device=True, latched=latched)
        self._loop.schedule(self._loop.now_ns + PAUSE_NS, DEVICE, partial(self._deliver, topic))
