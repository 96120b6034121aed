"""Requests that end by themselves unless they are repeated."""

from __future__ import annotations

import threading
import time
from collections.abc import Collection

from chefbot.ros2.tools.common import ToolError

LEASE = 5.0
"""Time after the last request for which a name counts, s."""


class Leases:
    """Names that were requested in the last seconds, by all clients together. Thread-safe."""

    def __init__(self, limit: int, refusal: str = "") -> None:
        self._limit, self._refusal = limit, refusal
        self._lock = threading.Lock()
        self._ends: dict[str, float] = {}

    def renew(self, names: Collection[str]) -> None:
        """Request these names for some seconds. Raises ToolError, the refusal, for more than the limit in all."""
        now = time.monotonic()
        with self._lock:
            ends = {name: end for name, end in self._ends.items() if end > now}
            ends |= dict.fromkeys(names, now + LEASE)
            if len(ends) > self._limit:
                raise ToolError(self._refusal)
            self._ends = ends

    def names(self) -> list[str]:
        """Return the names that are requested now, sorted."""
        now = time.monotonic()
        with self._lock:
            return sorted(name for name, end in self._ends.items() if end > now)
