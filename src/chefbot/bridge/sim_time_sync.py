"""How far the processes of a launch have come in simulated time, told to the one that leads it."""

from __future__ import annotations

import threading
from collections.abc import Callable

from chefbot.msgs.std_msgs import Header
from chefbot.ros2.rmw.node import WireNode

REACHED = "chefbot/reached"
"""`frame_id` is the process, `stamp` the time up to which it has done everything."""
PERIOD_NS = 40_000_000
"""It is told at most so often, in simulated time."""


class Follower:
    """A process that follows says how far it is.

    In a thread of its own: who calls `tell` holds the loop's lock, for which Zenoh's threads wait while they hold
    what sending needs.
    """

    def __init__(self, node: WireNode, process: str) -> None:
        self._node = node  # it lives as long as this
        self._publisher = node.publisher(REACHED, Header)
        self._process = process
        self._reached_ns = self._told_ns = -PERIOD_NS
        self._new = threading.Event()
        threading.Thread(target=self._work, name="follower", daemon=True).start()

    def tell(self, reached_ns: int) -> None:
        """If it is worth telling; returns at once."""
        if reached_ns - self._told_ns >= PERIOD_NS:
            self._reached_ns = self._told_ns = reached_ns
            self._new.set()

    def _work(self) -> None:
        while self._new.wait():
            self._new.clear()
            self._publisher.publish(Header.of(self._reached_ns, self._process))


def hear_followers(node: WireNode, tell: Callable[[str, int], None]) -> None:
    """Calls `tell(process, reached_ns)` in Zenoh's threads until the node is closed."""
    node.subscription(REACHED, Header, lambda header: tell(header.frame_id, header.stamp.ns))
