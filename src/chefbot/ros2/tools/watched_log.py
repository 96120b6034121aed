"""The log messages of all nodes, as rqt_console shows them."""

from __future__ import annotations

from collections import deque

from chefbot.msgs.rcl_interfaces import Log
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import ROSOUT
from chefbot.ros2.tools.inspection_views import LogLine

KEPT_LINES = 200
"""Number of messages kept."""
MAX_LENGTH = 500
"""Maximum length of a shown message; the rest of a longer one is cut off."""


class WatchedLog:
    """Keeps the newest messages of /rosout while it is watched."""

    def __init__(self, node: RmwNode) -> None:
        self._node = node
        self._lines: deque[LogLine] = deque(maxlen=KEPT_LINES)
        self._subscription = node.subscription("/rosout", Log, self._receive, ROSOUT)

    def lines(self) -> tuple[LogLine, ...]:
        """Return the newest messages, the last one last."""
        return tuple(self._lines.copy())

    def close(self) -> None:
        """End the subscription to the log."""
        self._node.destroy(self._subscription)

    def _receive(self, log: Log) -> None:
        """Keep a message, in a thread of Zenoh; deques are safe from several threads."""
        text = log.msg if len(log.msg) <= MAX_LENGTH else f"{log.msg[:MAX_LENGTH]} …"
        self._lines.append(LogLine(round(log.stamp.ns / 1e9, 3), log.level, log.name[:100], text))
