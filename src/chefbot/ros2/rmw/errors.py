"""What is refused on the wire, and the tally of it."""

from __future__ import annotations

import threading
from collections import Counter


class WireError(ValueError):
    """A token, QoS string, attachment or name that is not of rmw_zenoh's form; says which and why."""


class Tally:
    """Counts by reason; any thread. What is refused or dropped is counted here under a sentence."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._lock = threading.Lock()

    def add(self, reason: str) -> None:
        """Once more."""
        with self._lock:
            self._counts[reason] += 1

    def counts(self) -> dict[str, int]:
        """Reason to how often, so far."""
        with self._lock:
            return dict(self._counts)

    def total(self) -> int:
        """All together."""
        with self._lock:
            return self._counts.total()
