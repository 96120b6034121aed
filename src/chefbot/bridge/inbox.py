"""From the wire's threads into the loop: bounded, paced, and in the loop's one order."""

from __future__ import annotations

import threading
from collections import deque
from functools import partial

from chefbot.msgs.idl.message import Message
from chefbot.ros2.rmw.errors import Tally
from chefbot.runtime.loop import DEVICE, Loop

WIRE = "wire"
"""Who publishes in the loop what came from outside; a log's replay speaks for it, as for devices."""
DEPTH = 10
PAUSE_NS = 10_000_000
"""Between two deliveries on one topic: a flood costs the loop at most DEPTH messages in this time."""


class Inbox:
    """`say` from any thread; the loop publishes it as a device's message at an instant of its own."""

    def __init__(self, loop: Loop, dropped: Tally) -> None:
        self._loop = loop
        self._dropped = dropped
        self._waiting: dict[str, deque[tuple[Message, bool]]] = {}
        self._lock = threading.Lock()

    def say(self, topic: str, message: Message, *, latched: bool = False, depth: int = DEPTH) -> None:
        """Publish it in the loop soon; where `depth` messages wait already, the oldest of them is lost."""
        with self._lock:
            queue = self._waiting.get(topic)
            if queue is not None:  # the loop knows already that something is here
                if len(queue) >= depth:
                    queue.popleft()
                    self._dropped.add(f"/{topic}: more comes in than can be heard, the oldest is lost")
                queue.append((message, latched))
                return
            self._waiting[topic] = deque([(message, latched)])
        self._loop.post(partial(self._deliver, topic))

    def _deliver(self, topic: str) -> None:
        """In the loop: all that waits on one topic, and again after the pause, until nothing is there."""
        with self._lock:
            waiting = list(self._waiting[topic])
            self._waiting[topic].clear()
            if not waiting:
                del self._waiting[topic]
                return
        for message, latched in waiting:
            self._loop.publish(topic, message, WIRE, from_device=True, latched=latched)
        self._loop.at(self._loop.now_ns + PAUSE_NS, DEVICE, partial(self._deliver, topic))
