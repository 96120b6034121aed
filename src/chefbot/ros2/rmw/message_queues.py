"""Message queues between threads: bounded per topic, keeping the newest and counting what is dropped."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Hashable
from typing import Generic, TypeVar

from chefbot.ros2.rmw.errors import ErrorCounter

T = TypeVar("T")


class MessageQueues(Generic[T]):
    """Bounded queues per key that are read as one, in order of arrival. Thread-safe."""

    def __init__(self, dropped: ErrorCounter, why: str) -> None:
        self._dropped = dropped
        self._why = why
        self._queues: dict[Hashable, deque[T]] = {}
        self._order: deque[Hashable] = deque()
        self._filled = threading.Condition()

    def put(self, key: Hashable, item: T, depth: int, *, count_drops: bool = True) -> None:
        """Append an item; if `depth` items already wait under `key`, the oldest of them is dropped.

        Without `count_drops` it is not counted: nobody misses it, or only the latest item matters.
        """
        with self._filled:
            queue = self._queues.setdefault(key, deque())
            if len(queue) >= depth:
                queue.popleft()
                if count_drops:
                    self._dropped.add(f"{key}: {self._why}")
            else:
                self._order.append(key)
            queue.append(item)
            self._filled.notify()

    def take(self, timeout: float) -> T | None:
        """Remove and return the next item, or None if none arrives within `timeout` seconds."""
        with self._filled:
            if not self._order:
                self._filled.wait(timeout)
            return self._queues[self._order.popleft()].popleft() if self._order else None
