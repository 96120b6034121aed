"""A position in a recorded log that advances with time or jumps."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from chefbot.runtime.recorded_log import LoggedMessage

OWN_TOPICS = "chefbot/"
"""Begin of the topics by which a launch controls its own nodes; they are not played."""
ACCUMULATED = {"tf_static", "causes"}
"""Topics of which all messages count, not only the latest one."""
TF_SPAN_NS = 2_000_000_000
"""Part of /tf that is published after a jump, ns: a message contains some of the frames only."""


class LogPlayer:
    """Returns the messages of a log that are due; times are those of the log, ns."""

    def __init__(self, messages: Sequence[LoggedMessage]) -> None:
        played = [message for message in messages if not message.topic.startswith(OWN_TOPICS)]
        self._messages = sorted(played, key=lambda message: message.time_ns)
        self._times = [message.time_ns for message in self._messages]
        self._next = 0
        self.begin_ns = self._times[0] if self._times else 0
        self.end_ns = self._times[-1] if self._times else 0
        self.now_ns = self.begin_ns

    @property
    def at_end(self) -> bool:
        """Whether everything has been played."""
        return self._next >= len(self._messages)

    def advance(self, to_ns: int) -> Sequence[LoggedMessage]:
        """Set the position to a later time; return the messages up to it that were not returned yet."""
        self.now_ns = min(max(to_ns, self.now_ns), self.end_ns)
        first, self._next = self._next, bisect_right(self._times, self.now_ns)
        return self._messages[first : self._next]

    def jump(self, to_ns: int) -> list[LoggedMessage]:
        """Set the position; return what was known then: the latest message of each topic and publisher before it."""
        self.now_ns = min(max(to_ns, self.begin_ns), self.end_ns)
        self._next = bisect_right(self._times, self.now_ns)
        latest: dict[tuple[str, str, int], LoggedMessage] = {}
        for index, message in enumerate(self._messages[: self._next]):
            recent_tf = message.topic == "tf" and message.time_ns >= self.now_ns - TF_SPAN_NS
            number = index if recent_tf or message.topic in ACCUMULATED else -1
            latest[message.topic, message.publisher, number] = message
        return sorted(latest.values(), key=lambda message: message.time_ns)
