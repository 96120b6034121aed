"""/rosout: what a node has to say to people."""

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray
from chefbot.msgs.rcl_interfaces import ERROR, INFO, Log
from chefbot.msgs.rcl_interfaces import WARN as LOG_WARN
from chefbot.msgs.std_msgs import String
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos import ROSOUT
from chefbot.runtime.loop import Publication


def is_for_people(publication: Publication) -> bool:
    """Whether it may have to be told on /rosout, also when nobody hears its own topic."""
    return publication.topic.endswith("/remark") or isinstance(publication.message, DiagnosticArray)


class Rosout:
    """One node's. Remarks are told as they are; of diagnostics what has become worse or better."""

    def __init__(self, node: WireNode) -> None:
        self._name = node.full_name.lstrip("/").replace("/", ".")
        self._publisher = node.publisher("/rosout", Log, ROSOUT)
        self._levels: dict[str, tuple[int, str]] = {}

    def hear(self, publication: Publication) -> None:
        """Tell it if it is for people."""
        message, now_ns = publication.message, publication.time_ns
        if publication.topic.endswith("/remark") and isinstance(message, String):
            self.say(INFO, message.data, now_ns)
        elif isinstance(message, DiagnosticArray):
            for one in message.status:
                self._hear_status(one.name, one.level, one.message, now_ns)

    def say(self, level: int, text: str, now_ns: int) -> None:
        """One line."""
        self._publisher.publish(Log(Time.of(now_ns), level, self._name, text))

    def _hear_status(self, name: str, level: int, text: str, now_ns: int) -> None:
        before, self._levels[name] = self._levels.get(name, (OK, "")), (level, text)
        if before != (level, text) and (level != OK or before[0] != OK):
            self.say({OK: INFO, WARN: LOG_WARN}.get(level, ERROR), f"{name}: {text}", now_ns)
