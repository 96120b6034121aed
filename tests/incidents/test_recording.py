"""A recording begins with what was known, and ends by an order, after an hour, or before the disk is full."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from tests.incidents.test_buffer import SECOND, published

from chefbot.incidents.recording import (
    CHECK_INTERVAL,
    DISK_FULL,
    MAX_LENGTH_NS,
    MIN_FREE,
    TOO_LONG,
    Recording,
)
from chefbot.msgs.sensor_msgs import Image
from chefbot.runtime.loop import Publication


class Usage(NamedTuple):
    """What shutil.disk_usage returns."""

    total: int
    used: int
    free: int


def recorded(tmp_path: Path, *publications: Publication) -> tuple[list[Publication], str]:
    """What a recording contains, and why it ended by itself."""
    one = Recording([published("before", 0)], tmp_path)
    for publication in publications:
        one(publication)
    one.end()
    return list(one), one.reason


def test_it_contains_what_was_published_until_its_end(tmp_path: Path) -> None:
    one = Recording([published("before", 0)], tmp_path)
    one(published("a", 1))
    one.end()
    one(published("late", 2))
    one.end()
    assert [publication.topic for publication in one] == ["before", "a"] and one.reason == ""


def test_of_frequent_pictures_it_contains_a_part(tmp_path: Path) -> None:
    pictures = [published("picture", number * SECOND, Image()) for number in range(12)]
    content, _ = recorded(tmp_path, *pictures)
    assert [one.time_ns for one in content[1:]] == [0, 5 * SECOND, 10 * SECOND]


def test_it_ends_after_an_hour(tmp_path: Path) -> None:
    content, reason = recorded(
        tmp_path,
        *(published("a", time_ns) for time_ns in (SECOND, MAX_LENGTH_NS, MAX_LENGTH_NS + 2 * SECOND, 9)),
    )
    assert len(content) == 4 and reason == TOO_LONG


def test_it_ends_before_the_disk_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    free = np.array([MIN_FREE, MIN_FREE - 1]).tolist()
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(10**12, 0, free.pop(0)))
    content, reason = recorded(tmp_path, *(published("a", number) for number in range(3 * CHECK_INTERVAL)))
    assert len(content) == 1 + 2 * CHECK_INTERVAL and reason == DISK_FULL
