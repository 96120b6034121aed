"""Hand-over between threads: bounded for each topic, the newest kept, what is lost counted by name."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Hashable
from typing import Generic, TypeVar

from chefbot.ros2.rmw.errors import Tally

T = TypeVar("T")


class Queues(Generic[T]):
    """Many small queues read as one, in the order in which things came. Any thread puts, any takes."""

    def __init__(self, dropped: Tally, why: str) -> None:
        self._dropped = dropped
        self._why = why
        self._queues: dict[Hashable, deque[T]] = {}
        self._order: deque[Hashable] = deque()
        self._filled = threading.Condition()

    def put(self, key: Hashable, item: T, depth: int, *, newest: bool = False) -> None:
        """Behind what is there; where `depth` things wait under `key` already, the oldest of them is lost.

        `newest`: only the newest ever counts, so that this is no loss.
        """
        with self._filled:
            queue = self._queues.setdefault(key, deque())
            if len(queue) >= depth:
                queue.popleft()
                if not newest:
                    self._dropped.add(f"{key}: {self._why}")
            else:
                self._order.append(key)
            queue.append(item)
            self._filled.notify()

    def take(self, timeout: float) -> T | None:
        """The next thing, None after `timeout` seconds without one."""
        with self._filled:
            if not self._order:
                self._filled.wait(timeout)
            return self._queues[self._order.popleft()].popleft() if self._order else None
