"""When a sensor last had data in each direction around the robot."""

from __future__ import annotations

import math

import numpy as np

from chefbot.control.seen_directions import SAME_PLACE_DISTANCE, SECTOR, SeenDirections
from chefbot.maths.se2 import IDENTITY, SE2

AHEAD = np.linspace(-0.5, 0.5, 60)


def seen_at(stamp_ns: int, robot: SE2 = IDENTITY) -> SeenDirections:
    seen = SeenDirections()
    seen.process(robot, AHEAD, np.ones(len(AHEAD), np.bool_), stamp_ns)
    return seen


def test_directions_with_data_are_seen_and_others_are_not() -> None:
    seen = seen_at(10)
    assert not len(seen.not_seen_since(10, -0.4, 0.4))
    assert len(seen.not_seen_since(11, -0.4, 0.4))
    behind = seen.not_seen_since(10, math.pi - 0.2, math.pi + 0.2)
    assert len(behind) and np.abs(behind - math.pi).max() <= 0.2 + SECTOR


def test_a_direction_without_data_is_seen_no_more() -> None:
    seen = seen_at(10)
    seen.process(IDENTITY, AHEAD, AHEAD > 0.0, 20)
    assert len(seen.not_seen_since(10, -0.4, -0.1))
    assert not len(seen.not_seen_since(20, 0.1, 0.4))


def test_what_was_seen_from_elsewhere_is_forgotten() -> None:
    seen = seen_at(10)
    none = np.zeros(0)
    seen.process(SE2(0.9 * SAME_PLACE_DISTANCE, 0.0, 0.0), none, none.astype(np.bool_), 20)
    assert not len(seen.not_seen_since(10, -0.4, 0.4))
    seen.process(SE2(1.1 * SAME_PLACE_DISTANCE, 0.0, 0.0), none, none.astype(np.bool_), 30)
    assert len(seen.not_seen_since(10, -0.4, 0.4))
