"""Tests of the places on the way at which drives have ended."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.exploration.dead_ends import MAX_DRIVES, DeadEnds
from chefbot.maths.se2 import SE2


def line(begin: tuple[float, float], end: tuple[float, float]) -> np.ndarray:
    """A path between two points, with a pose every 2 cm or so."""
    return np.linspace(begin, end, 200)


THROUGH, BACK, BESIDE = line((0, 0), (4, 0)), line((0, 0), (-4, 0)), line((0, 0), (1, 3))


@pytest.mark.parametrize("drives", range(MAX_DRIVES + 2))
def test_after_three_drives_no_path_leads_through_the_place(drives: int) -> None:
    dead_ends = DeadEnds()
    for drive in range(drives):
        dead_ends.add(SE2(0.05 * (drive % 2), 0.0, 0.0), THROUGH)
    closed = drives >= MAX_DRIVES
    assert dead_ends.is_on(THROUGH) is closed and dead_ends.is_on(THROUGH[::-1]) is closed
    assert not dead_ends.is_on(BACK) and not dead_ends.is_on(BESIDE)


def test_drives_that_ended_at_different_places_close_nothing() -> None:
    dead_ends = DeadEnds()
    for x in range(MAX_DRIVES):
        dead_ends.add(SE2(float(x), 0.0, 0.0), THROUGH)
    assert not dead_ends.is_on(THROUGH)


def test_at_the_end_of_its_path_or_without_one_there_is_no_place() -> None:
    dead_ends = DeadEnds()
    for _ in range(MAX_DRIVES):
        dead_ends.add(SE2(3.9, 0.0, 0.0), THROUGH[-10:])
        dead_ends.add(SE2(0.0, 0.0, 0.0), np.zeros((0, 3)))
    assert not dead_ends.is_on(THROUGH) and not dead_ends.is_on(np.zeros((0, 3)))
