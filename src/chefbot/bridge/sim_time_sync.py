"""Progress of a launch's processes in simulated time, published to the process that leads it."""

from __future__ import annotations

import threading
from collections.abc import Callable

from chefbot.msgs.std_msgs import Header
from chefbot.ros2.rmw.node import RmwNode

REACHED = "chefbot/reached"
"""Topic; `frame_id` is the process, `stamp` the time up to which it has handled all events."""
MIN_PERIOD_NS = 40_000_000
"""Minimum period of progress messages, ns of simulated time."""


class ProgressPublisher:
    """Publishes how far a following process has come in simulated time.

    A thread of its own publishes: the caller of `publish` holds the loop's lock, for which Zenoh's threads wait
    while they hold a lock that publishing needs.
    """

    def __init__(self, node: RmwNode, process: str) -> None:
        self._node = node  # keep the node alive
        self._publisher = node.publisher(REACHED, Header)
        self._process = process
        self._reached_ns = self._published_ns = -MIN_PERIOD_NS
        self._wake = threading.Event()
        threading.Thread(target=self._run, name="follower", daemon=True).start()

    def publish(self, reached_ns: int) -> None:
        """Publish the progress if the minimum period has passed; does not block."""
        if reached_ns - self._published_ns >= MIN_PERIOD_NS:
            self._reached_ns = self._published_ns = reached_ns
            self._wake.set()

    def _run(self) -> None:
        while self._wake.wait():
            self._wake.clear()
            self._publisher.publish(Header.of(self._reached_ns, self._process))


def subscribe_to_progress(node: RmwNode, callback: Callable[[str, int], None]) -> None:
    """Call `callback(process, reached_ns)` for each progress message until the node is closed.

    The calls come from Zenoh's threads.
    """
    node.subscription(REACHED, Header, lambda header: callback(header.frame_id, header.stamp.ns))
