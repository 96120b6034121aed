"""The time that `now` means in a message: that of the robot, which a simulation publishes on /clock."""

from __future__ import annotations

import contextlib
import queue
import time

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK
from chefbot.ros2.tools.common import ToolError

CLOCK_TIMEOUT = 2.0
"""Maximum time to wait for the first message on a clock topic that has a publisher, s."""


class RobotClock:
    """The clock of the robot to which a name belongs: its simulated time if it has one, else the computer's."""

    def __init__(self, node: RmwNode, name: str) -> None:
        self._topic, self._newest_ns = _clock_topic(node.wire.graph, name), 0
        self._times: queue.SimpleQueue[int] = queue.SimpleQueue()
        if self._topic:
            node.subscription(self._topic, Clock, lambda message: self._times.put(message.clock.ns), CLOCK)

    def now(self) -> Time:
        """Return the newest time; ToolError if a simulated robot has published none yet."""
        if not self._topic:
            return Time.of(time.time_ns())
        with contextlib.suppress(queue.Empty):
            while True:
                self._newest_ns = self._times.get(block=not self._newest_ns, timeout=CLOCK_TIMEOUT)
        if not self._newest_ns:
            raise ToolError(f"no time on {self._topic} for {CLOCK_TIMEOUT:g} s: the simulation stands still")
        return Time.of(self._newest_ns)


def _clock_topic(graph: Graph, name: str) -> str:
    """Return the clock topic with a publisher in the innermost namespace of a name, empty if there is none."""
    topics, namespace = graph.topics(), name
    while namespace:
        namespace = namespace.rpartition("/")[0]
        endpoints = topics.get(f"{namespace}/clock")
        if endpoints is not None and endpoints.providers:
            return f"{namespace}/clock"
    return ""
