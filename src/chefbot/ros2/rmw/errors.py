"""The errors of rmw_zenoh's data and sessions, and a counter of rejected messages."""

from __future__ import annotations

import threading
from collections import Counter

from chefbot.errors import ChefbotError

QUEUE_FULL = "queue is full, the oldest message is dropped"
"""End of the reasons for messages that are lost because this process does not keep up."""


class RmwError(ChefbotError):
    """Raised for a token, QoS string, attachment or name that does not have rmw_zenoh's form.

    The message names the offending text and the reason.
    """


class SessionError(ChefbotError):
    """Raised when a session on the network cannot be opened: an invalid domain, or no way to the router."""


class ErrorCounter:
    """A thread-safe counter of rejected or dropped messages, by reason."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._lock = threading.Lock()

    def add(self, reason: str) -> None:
        """Count one more occurrence of a reason."""
        with self._lock:
            self._counts[reason] += 1

    def counts(self) -> dict[str, int]:
        """Return the number of occurrences of each reason so far."""
        with self._lock:
            return dict(self._counts)
