"""Where a robot that is not localized drives: along the open way that leads farthest from where it has been."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.behavior.open_directions import MAX_LEG_LENGTH, OpenDirections

RADIUS = 0.2
BEARINGS = np.radians(np.arange(-180.0, 180.0))
HERE = np.zeros(2)


def corridor(bearings: np.ndarray, half_width: float, door: tuple[float, float] = (9.0, 9.5)) -> np.ndarray:
    """Ranges in a corridor along x, closed 2 m behind; a door in the left wall from x = door[0] to door[1]."""
    with np.errstate(divide="ignore"):
        wall = half_width / np.abs(np.sin(bearings))
        back = np.where(np.cos(bearings) < 0.0, -2.0 / np.cos(bearings), np.inf)
    x = wall * np.cos(bearings)
    opened = (np.sin(bearings) > 0.0) & (x > door[0]) & (x < door[1])
    return np.minimum(np.where(opened, 6.0, wall), back)


def seen(ranges: np.ndarray, yaw: float = 0.0) -> OpenDirections:
    ways = OpenDirections(RADIUS)
    ways.process(BEARINGS, ranges, 8.0, yaw)
    return ways


@given(yaw=st.floats(-3.0, 3.0), half_width=st.floats(0.5, 1.5))
def test_a_corridor_is_driven_along(yaw: float, half_width: float) -> None:
    way = seen(corridor(BEARINGS, half_width), yaw).best(HERE, HERE[None, :])
    assert math.cos(way.heading - yaw) > math.cos(0.4) and way.length > 0.9 * MAX_LEG_LENGTH
    end = way.length * math.sin(way.heading - yaw)
    assert abs(end) < half_width - RADIUS, "the way is free to its end"


def test_where_the_robot_has_been_is_worth_less() -> None:
    ranges = np.minimum(
        corridor(BEARINGS, 1.0), np.where(np.cos(BEARINGS) > 0.0, 3.0 / np.cos(BEARINGS), 99.0)
    )
    ways = seen(ranges)
    assert math.cos(ways.best(HERE, HERE[None, :]).heading) > 0.9
    ahead = np.column_stack([np.arange(3.0, -0.1, -0.5), np.zeros(7)])
    assert math.cos(ways.best(HERE, ahead).heading) < -0.9


def test_the_oldest_place_is_visited_again_at_a_dead_end() -> None:
    """It came along the corridor from behind, and everything ahead is closed."""
    ranges = np.where(np.abs(BEARINGS) < 1.7, 0.35, 6.0)
    came = np.column_stack([-np.arange(10.0, 0.0, -0.5), np.zeros(20)])
    way = seen(ranges).best(HERE, came)
    assert math.cos(way.heading) < -0.9 and way.length > 2.0


def test_a_doorway_is_passed_in_its_middle() -> None:
    ways = seen(np.minimum(corridor(BEARINGS, 1.0, (-0.5, 0.5)), 6.0))
    visited = np.column_stack([np.linspace(-2.0, 6.0, 30), np.zeros(30)])
    way = ways.best(HERE, visited)
    assert way.heading == pytest.approx(math.pi / 2, abs=0.1)


def test_unknown_directions_are_not_driven() -> None:
    ranges = np.full(len(BEARINGS), np.nan)
    assert seen(ranges).best(HERE, HERE[None, :]).length == 0.0
    ranges[np.abs(BEARINGS) < 0.5] = math.inf
    way = seen(ranges).best(HERE, HERE[None, :])
    assert abs(way.heading) < 0.5 and way.length == MAX_LEG_LENGTH
    ways = seen(ranges)
    ways.clear()
    assert ways.best(HERE, HERE[None, :]).length == 0.0


@pytest.mark.parametrize(("half_gap", "is_open"), [(0.2, False), (0.4, True)])
def test_a_gap_narrower_than_the_robot_is_closed(half_gap: float, is_open: bool) -> None:
    y = 1.0 * np.tan(np.radians(np.arange(-80.0, 81.0)))
    ranges = np.where(np.abs(y) > half_gap, np.hypot(1.0, y), np.inf)
    ways = OpenDirections(RADIUS)
    ways.process(np.arctan2(y, 1.0), ranges, 8.0, 0.0)
    way = ways.best(HERE, HERE[None, :])
    assert (way.length > 1.0 and abs(way.heading) < 0.3) == is_open
