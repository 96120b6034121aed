"""Writes that wait until the disk takes them, such as a full one that is freed again."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from chefbot.storage.history_file import utc_now

T = TypeVar("T")


class PendingWrites(Generic[T]):
    """Writes values in their order; what cannot be written is kept, with its time, for the next attempt.

    write: writes a value of a time (UTC, ISO 8601) whole or not at all, and returns whether anything has changed.
    limit: number of values that are kept; then the oldest are lost.
    """

    def __init__(self, write: Callable[[T, str], bool], limit: int) -> None:
        self._write = write
        self._values: deque[tuple[T, str]] = deque(maxlen=limit)

    def __len__(self) -> int:
        return len(self._values)

    def add(self, value: T) -> bool:
        """Write a value after those that wait, and return whether anything has changed. Raises StorageError."""
        self._values.append((value, utc_now()))
        return self.retry()

    def retry(self) -> bool:
        """Write what waits, and return whether anything has changed. Raises StorageError at the first failure."""
        changed = False
        while self._values:
            changed = self._write(*self._values[0]) or changed
            self._values.popleft()
        return changed
