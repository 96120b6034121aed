"""The time of a robot that is simulated in another process, as it tells it on /clock."""

from __future__ import annotations

import queue
from collections.abc import Callable

from chefbot.errors import UserError
from chefbot.msgs.rosgraph_msgs import Clock as ClockMessage
from chefbot.ros2.rmw.names import resolve
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos import CLOCK
from chefbot.runtime.clock import FollowedClock
from chefbot.runtime.loop import Loop

PATIENCE = 20.0
"""Seconds to wait for the first word."""


class RobotTime:
    """`clock` for a loop that begins at `start_ns`, and which `drive` then wakes."""

    def __init__(self, node: WireNode, reached: Callable[[int], None] = lambda _: None) -> None:
        """Waits for the first word; `reached` as for FollowedClock. UserError if none comes."""
        self._first: queue.SimpleQueue[int] = queue.SimpleQueue()
        self._loop: Loop | None = None
        self._clock: FollowedClock | None = None
        node.subscription("clock", ClockMessage, self._hear, CLOCK)
        try:
            self.start_ns = self._first.get(timeout=PATIENCE)
        except queue.Empty:
            topic = resolve("clock", node.id.namespace)
            raise UserError(f"{topic} is silent for {PATIENCE:.0f} s; does time go on there?") from None
        self.clock = self._clock = FollowedClock(self.start_ns, reached)

    def drive(self, loop: Loop) -> None:
        """It runs by `clock`."""
        self._loop = loop

    def _hear(self, message: ClockMessage) -> None:
        """In Zenoh's thread."""
        if self._clock is None:
            self._first.put(message.clock.ns)
            return
        self._clock.tell(message.clock.ns)
        if self._loop is not None:
            self._loop.wake()
