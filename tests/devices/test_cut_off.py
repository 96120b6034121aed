"""Tests which places a keep-out zone or a one-way lane cuts off: the planner's own answer on the map."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.devices.cut_off import CutOff, Reach, Walls, cut_off, reach
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, SLOW_ZONE, MapZone
from chefbot.msgs.geometry_msgs import Point
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot_lidar")
START = SE2(1.0, 1.0, 0.0)


def corridor() -> Grid:
    """A corridor of 10 m x 2 m with walls around it."""
    cells = np.zeros((40, 200), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return Grid(cells, 0.05, 0.0, 0.0)


def barrier(kind: str = KEEP_OUT, top: float = 2.0, direction: float = 0.0, bottom: float = 0.0) -> MapZone:
    corners = ((5.0, bottom), (5.3, bottom), (5.3, top), (5.0, top))
    return MapZone("barrier", kind, tuple(Point(x, y, 0.0) for x, y in corners), direction=direction)


PLACES = {"near": SE2(4.0, 1.0, 0.0), "far": SE2(8.0, 1.0, 0.0), "outside": SE2(20.0, 1.0, 0.0)}


def changed(before: tuple[MapZone, ...], after: tuple[MapZone, ...], grid: Grid | None = None) -> CutOff:
    """What new zones or, with a grid, another map cut off."""
    walls = Walls(corridor(), before), Walls(grid or corridor(), after)
    return cut_off(ROBOT, START, PLACES, *walls)


def lost(before: tuple[MapZone, ...], after: tuple[MapZone, ...], grid: Grid | None = None) -> list[str]:
    """The places to which there is no path any more."""
    return changed(before, after, grid).no_path


def test_a_wall_cuts_off_what_is_behind_it() -> None:
    walled = corridor()
    walled.cells[:, 120] = 100
    assert lost((), (), walled) == ["far"]


def test_a_barrier_cuts_off_what_is_behind_it() -> None:
    both = {"near", "far"}
    assert reach(Walls(corridor(), ()), ROBOT, START, PLACES) == Reach(both, both)
    assert lost((), (barrier(),)) == ["far"]
    assert lost((barrier(),), (barrier(),)) == []


@pytest.mark.parametrize("zone", [barrier(SLOW_ZONE), barrier(top=0.5)])
def test_other_kinds_and_gaps_for_the_robot_cut_off_nothing(zone: MapZone) -> None:
    assert lost((), (zone,)) == []


def test_a_gap_narrower_than_the_robot_is_not_a_passage() -> None:
    gap = 2.0 * ROBOT.circumscribed_radius - 0.1
    assert lost((), (barrier(top=1.95 - gap),)) == ["far"]


def test_a_lane_across_the_only_path_cuts_off_in_one_direction() -> None:
    towards_the_robot = barrier(ONE_WAY, direction=np.pi)
    assert changed((), (towards_the_robot,)) == (["far"], [])
    away_from_the_robot = barrier(ONE_WAY)
    assert changed((), (away_from_the_robot,)) == ([], ["far"])
    assert changed((away_from_the_robot,), (away_from_the_robot,)) == ([], [])
    assert changed((away_from_the_robot,), (towards_the_robot,)) == (["far"], [])


def test_a_lane_beside_another_path_cuts_off_nothing() -> None:
    half = barrier(ONE_WAY, direction=np.pi, top=1.0)
    other = barrier(ONE_WAY, bottom=1.0)
    assert changed((), (half,)) == changed((), (half, other)) == ([], [])


def test_with_a_barrier_before_it_a_lane_cuts_off_nothing_more() -> None:
    assert changed((barrier(),), (barrier(), barrier(ONE_WAY, direction=np.pi))) == ([], [])
