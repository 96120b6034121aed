"""Tests which places a keep-out zone cuts off: the planner's own answer on the map."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.devices.cut_off import Walls, cut_off, reachable
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, SLOW_ZONE, MapZone
from chefbot.msgs.geometry_msgs import Point
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot_lidar")
START = SE2(1.0, 1.0, 0.0)


def corridor() -> Grid:
    """A corridor of 10 m x 2 m with walls around it."""
    cells = np.zeros((40, 200), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return Grid(cells, 0.05, 0.0, 0.0)


def barrier(kind: str = KEEP_OUT, top: float = 2.0) -> MapZone:
    corners = ((5.0, 0.0), (5.3, 0.0), (5.3, top), (5.0, top))
    return MapZone("barrier", kind, tuple(Point(x, y, 0.0) for x, y in corners))


PLACES = {"near": SE2(4.0, 1.0, 0.0), "far": SE2(8.0, 1.0, 0.0), "outside": SE2(20.0, 1.0, 0.0)}


def lost(before: tuple[MapZone, ...], after: tuple[MapZone, ...], grid: Grid | None = None) -> list[str]:
    """The places that are cut off by new zones or, with a grid, by another map."""
    walls = Walls(corridor(), before), Walls(grid or corridor(), after)
    return cut_off(ROBOT, START, PLACES, *walls)


def test_a_wall_cuts_off_what_is_behind_it() -> None:
    walled = corridor()
    walled.cells[:, 120] = 100
    assert lost((), (), walled) == ["far"]


def test_a_barrier_cuts_off_what_is_behind_it() -> None:
    assert reachable(corridor(), ROBOT, START, PLACES, ()) == {"near", "far"}
    assert lost((), (barrier(),)) == ["far"]
    assert lost((barrier(),), (barrier(),)) == []


@pytest.mark.parametrize("zone", [barrier(SLOW_ZONE), barrier(top=0.5)])
def test_other_kinds_and_gaps_for_the_robot_cut_off_nothing(zone: MapZone) -> None:
    assert lost((), (zone,)) == []


def test_a_gap_narrower_than_the_robot_is_not_a_passage() -> None:
    gap = 2.0 * ROBOT.circumscribed_radius - 0.1
    assert lost((), (barrier(top=1.95 - gap),)) == ["far"]
