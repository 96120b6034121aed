"""Zones that cannot be obeyed are refused with their names; those that are odd are warned of."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, SLOW_ZONE, MapZone
from chefbot.msgs.geometry_msgs import Point
from chefbot.zones.contradictions import ZoneError, check_zones

GRID = Grid(np.zeros((100, 200), np.int8), 0.05, 0.0, 0.0)


def zone(name: str, kind: str, points: list[tuple[float, float]], direction: float = 0.0) -> MapZone:
    return MapZone(name, kind, tuple(Point(x, y, 0.0) for x, y in points), 0.2, direction)


def box(x: float, y: float, width: float = 1.0, height: float = 1.0) -> list[tuple[float, float]]:
    return [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]


@pytest.mark.parametrize(
    ("points", "problem"),
    [
        ([(0.0, 0.0), (1.0, 1.0)], "zone a: it needs three corners or more, and has 2"),
        ([(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)], "zone a: its edges cross or touch each other"),
        ([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)], "zone a: it has no area"),
        (box(20.0, 1.0), "zone a lies outside the map"),
    ],
)
def test_a_zone_that_is_not_an_area_of_the_map_is_refused(
    points: list[tuple[float, float]], problem: str
) -> None:
    with pytest.raises(ZoneError, match=problem):
        check_zones((zone("a", KEEP_OUT, points),), GRID, {})


def test_one_way_lanes_against_each_other_are_refused() -> None:
    lanes = zone("out", ONE_WAY, box(1.0, 1.0)), zone("back", ONE_WAY, box(1.5, 1.0), math.pi)
    with pytest.raises(
        ZoneError, match=r"lane out and the one-way lane back overlap at x 1\..*differ by 180 deg"
    ):
        check_zones(lanes, GRID, {})


def test_lanes_that_touch_are_taken() -> None:
    lanes = zone("out", ONE_WAY, box(1.0, 1.0)), zone("back", ONE_WAY, box(2.0, 1.0), math.pi)
    assert check_zones(lanes, GRID, {}).warnings == ()


def test_what_has_no_effect_is_warned_of_by_name() -> None:
    zones = zone("stairs", KEEP_OUT, box(1.0, 1.0, 3.0, 3.0)), zone("ramp", SLOW_ZONE, box(2.0, 2.0))
    places = {"table_1": SE2(1.5, 1.5, 0.0), "home": SE2(5.0, 1.0, 0.0)}
    assert check_zones(zones, GRID, places).warnings == (
        "The slow zone ramp lies in the keep-out zone stairs and has no effect.",
        "The place table_1 lies in the keep-out zone stairs and cannot be reached.",
    )
    partly = check_zones((zone("edge", KEEP_OUT, box(-0.5, 1.0)),), GRID, {})
    assert partly.warnings == ("The keep-out zone edge lies partly outside the map.",)


@given(st.lists(st.tuples(st.floats(-3.0, 9.0), st.floats(-3.0, 9.0)), max_size=7))
def test_any_corners_are_accepted_or_refused_with_a_reason(points: list[tuple[float, float]]) -> None:
    try:
        report = check_zones((zone("a", ONE_WAY, points),), GRID, {"home": SE2(1.0, 1.0, 0.0)})
    except ZoneError as error:
        assert str(error).startswith("one-way lane a")
    else:
        assert all(sentence.endswith(".") for sentence in report.warnings)
