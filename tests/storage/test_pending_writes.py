"""What cannot be written waits, in its order and with its time."""

from __future__ import annotations

import pytest

from chefbot.storage import pending_writes
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.pending_writes import PendingWrites


class Disk:
    """Takes texts while it has room."""

    def __init__(self) -> None:
        self.room = 100
        self.texts: list[tuple[str, str]] = []

    def write(self, text: str, time: str) -> bool:
        if not self.room:
            raise StorageError("the disk is full")
        self.room -= 1
        self.texts.append((text, time))
        return text != "nothing new"


def test_values_wait_in_their_order_with_their_times(monkeypatch: pytest.MonkeyPatch) -> None:
    disk = Disk()
    pending = PendingWrites(disk.write, 10)
    clock = iter("12345")
    monkeypatch.setattr(pending_writes, "utc_now", lambda: next(clock))
    assert pending.add("a") and not pending.add("nothing new") and not pending
    disk.room = 0
    for text in "bc":
        with pytest.raises(StorageError):
            pending.add(text)
    disk.room = 1
    with pytest.raises(StorageError):
        pending.retry()
    disk.room = 5
    assert pending.retry() and not pending.retry()
    assert disk.texts == [("a", "1"), ("nothing new", "2"), ("b", "3"), ("c", "4")]


def test_the_oldest_values_are_lost_beyond_the_limit() -> None:
    disk = Disk()
    disk.room = 0
    pending = PendingWrites(disk.write, 2)
    for text in "abc":
        with pytest.raises(StorageError):
            pending.add(text)
    disk.room = 5
    pending.retry()
    assert [text for text, _ in disk.texts] == ["b", "c"]
