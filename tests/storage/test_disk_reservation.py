"""Reservation of disk space."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from chefbot.storage import disk_reservation
from chefbot.storage.disk_reservation import STEP, DiskReservation


@pytest.fixture
def handle(tmp_path: Path):
    opened = os.open(tmp_path / "log", os.O_RDWR | os.O_CREAT)
    yield opened
    os.close(opened)


@pytest.mark.parametrize("platform", ["linux", "darwin"])
def test_a_reservation_does_not_change_size_content_and_position(
    handle: int, monkeypatch: pytest.MonkeyPatch, platform: str
) -> None:
    monkeypatch.setattr(disk_reservation.sys, "platform", platform)
    os.write(handle, b"begun")
    DiskReservation(handle).reserve(100_000)
    assert os.fstat(handle).st_size == 5 and os.lseek(handle, 0, os.SEEK_CUR) == 5
    assert os.pread(handle, 10, 0) == b"begun"


def test_space_is_reserved_in_steps_and_released(handle: int, monkeypatch: pytest.MonkeyPatch) -> None:
    one, sizes = DiskReservation(handle), list[int]()
    allocate = one._allocate
    monkeypatch.setattr(one, "_allocate", lambda size: sizes.append(size) or allocate(size))
    for size in range(1000, 2 * STEP, 1000):
        one.reserve(size)
    assert len(sizes) == 2 and sizes[0] == 1000 + STEP
    os.write(handle, b"x" * 1000)
    one.release()
    assert os.fstat(handle).st_size == 1000


def test_a_full_disk_is_reported(handle: int, monkeypatch: pytest.MonkeyPatch) -> None:
    one = DiskReservation(handle)
    monkeypatch.setattr(one, "_allocate", lambda size: errno.ENOSPC if size > 5000 else 0)
    one.reserve(4000)
    with pytest.raises(OSError, match="space") as caught:
        one.reserve(6000)
    assert caught.value.errno == errno.ENOSPC


def test_a_size_limit_of_the_process_counts_as_full(handle: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_reservation, "_max_file_size", lambda: 10_000)
    with pytest.raises(OSError) as caught:
        DiskReservation(handle).reserve(20_000)
    assert caught.value.errno == errno.EFBIG


@pytest.mark.parametrize("platform", ["linux", "darwin"])
def test_a_pipe_is_not_reserved(monkeypatch: pytest.MonkeyPatch, platform: str) -> None:
    monkeypatch.setattr(disk_reservation.sys, "platform", platform)
    reading, writing = os.pipe()
    one = DiskReservation(writing)
    one.reserve(100_000)
    one.reserve(200_000)
    one.release()
    os.close(reading)
    os.close(writing)
