"""Simulated time of a robot that runs in another process, received on /clock."""

from __future__ import annotations

import queue
from collections.abc import Callable

from chefbot.errors import UserError
from chefbot.msgs.rosgraph_msgs import Clock as ClockMessage
from chefbot.ros2.rmw.names import resolve
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK
from chefbot.runtime.clock import FollowerClock
from chefbot.runtime.loop import Loop

CLOCK_TIMEOUT = 20.0
"""Maximum time to wait for the first /clock message, s."""


class RobotTime:
    """A `clock` that follows /clock.

    The loop that follows it begins at `start_ns`; `attach` takes it.
    """

    def __init__(self, node: RmwNode, reached: Callable[[int], None] = lambda _: None) -> None:
        """Wait for the first /clock message; `reached` is as for FollowerClock.

        Raises UserError if none is received.
        """
        self._first: queue.SimpleQueue[int] = queue.SimpleQueue()
        self._loop: Loop | None = None
        self._clock: FollowerClock | None = None
        node.subscription("clock", ClockMessage, self._on_clock, CLOCK)
        try:
            self.start_ns = self._first.get(timeout=CLOCK_TIMEOUT)
        except queue.Empty:
            topic = resolve("clock", node.id.namespace)
            raise UserError(f"no {topic} for {CLOCK_TIMEOUT:.0f} s; is the simulation running?") from None
        self.clock = self._clock = FollowerClock(self.start_ns, reached)

    def attach(self, loop: Loop) -> None:
        """Attach the loop that runs by this clock, to be woken at each /clock message."""
        self._loop = loop

    def _on_clock(self, message: ClockMessage) -> None:
        """Advance the clock; runs in Zenoh's thread."""
        if self._clock is None:
            self._first.put(message.clock.ns)
            return
        self._clock.set_time(message.clock.ns)
        if self._loop is not None:
            self._loop.wake()
