"""Logging of a node's notices and diagnostics on /rosout."""

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray
from chefbot.msgs.rcl_interfaces import ERROR, INFO, Log
from chefbot.msgs.rcl_interfaces import WARN as LOG_WARN
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import ROSOUT
from chefbot.runtime.loop import Publication


def is_for_operator(publication: Publication) -> bool:
    """Return whether a message may have to be logged on /rosout, even if its topic has no subscriber."""
    return publication.topic.endswith("/notice") or isinstance(publication.message, DiagnosticArray)


class Rosout:
    """The /rosout publisher of one node: logs its notices, and diagnostics whenever they change."""

    def __init__(self, node: RmwNode) -> None:
        self._name = node.full_name.lstrip("/").replace("/", ".")
        self._publisher = node.publisher("/rosout", Log, ROSOUT)
        self._levels: dict[str, tuple[int, str]] = {}

    def log_publication(self, publication: Publication) -> None:
        """Log the publication if it is a notice or a changed diagnostic."""
        message, now_ns = publication.message, publication.time_ns
        if publication.topic.endswith("/notice") and isinstance(message, String):
            self.log(INFO, message.data, now_ns)
        elif isinstance(message, DiagnosticArray):
            for status in message.status:
                self._log_status(status.name, status.level, status.message, now_ns)

    def log(self, level: int, text: str, now_ns: int) -> None:
        """Publish one log message on /rosout."""
        self._publisher.publish(Log(Time.of(now_ns), level, self._name, text))

    def _log_status(self, name: str, level: int, text: str, now_ns: int) -> None:
        previous, self._levels[name] = self._levels.get(name, (OK, "")), (level, text)
        if previous != (level, text) and (level != OK or previous[0] != OK):
            self.log({OK: INFO, WARN: LOG_WARN}.get(level, ERROR), f"{name}: {text}", now_ns)
