"""Lengths of routes: around walls, along lanes, never below the straight line, and estimated beyond the map."""

from __future__ import annotations

import numpy as np
import pytest
from tests.planning.rooms import RESOLUTION, two_rooms

from chefbot.costmap.params import CostmapParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs.maps import ONE_WAY, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point
from chefbot.nodes.navigation.costmap_layers import make_costmap
from chefbot.planning.route_lengths import DETOUR, RouteLengths
from chefbot.robot.load import load_robot


def routes(grid: Grid, *zones: MapZone) -> RouteLengths:
    costs = make_costmap(CostmapParams(), load_robot("chefbot_lidar"), rolling=False)
    costs.set_static(grid)
    costs.process(MapZones(zones=zones), IDENTITY)
    return RouteLengths(costs.update())


def test_a_path_through_a_door_is_longer_than_the_line() -> None:
    lengths = routes(two_rooms(door=1.2))
    a, b = SE2(3.0, 0.6, 0.0), SE2(5.0, 0.6, 0.0)
    round_the_wall = 2.0 * np.hypot(1.0, 1.4)
    assert round_the_wall * 0.8 <= lengths.between(a, b) <= round_the_wall * 1.8
    assert lengths.between(a, b) == pytest.approx(lengths.between(b, a), rel=0.02)
    near = lengths.between(SE2(1.0, 2.0, 0.0), SE2(3.0, 2.0, 0.0))
    assert near == pytest.approx(2.0, rel=0.1)


def test_a_place_in_the_inflation_counts_from_the_floor() -> None:
    lengths = routes(two_rooms(door=1.2))
    at_the_wall = SE2(2.0, 0.05, 0.0)
    assert 1.5 < lengths.between(at_the_wall, SE2(2.0, 2.0, 0.0)) < 3.0


@pytest.mark.parametrize("far", [SE2(99.0, 0.0, 0.0), SE2(5.0, 2.0, 0.0)])
def test_without_a_path_it_estimates_from_the_straight_line(far: SE2) -> None:
    lengths = routes(two_rooms(door=0.0))
    a = SE2(1.0, 2.0, 0.0)
    assert lengths.between(a, far) == pytest.approx(DETOUR * a.distance(far))
    assert lengths.between(far, a) == pytest.approx(DETOUR * a.distance(far))
    assert lengths.path_length(a, far) == lengths.path_length(far, a) == np.inf


def test_tables_are_kept_and_forgotten() -> None:
    lengths, pose = routes(two_rooms(door=1.2)), SE2(1.0, 2.0, 0.0)
    assert lengths.table(pose) is lengths.table(pose)
    kept = lengths.table(pose)
    lengths.forget(pose)
    assert lengths.table(pose) is not kept and RESOLUTION == 0.05


def lane(x: float, y: float, direction: float) -> MapZone:
    """A lane of 0.4 m about a point, across the door."""
    corners = ((x - 0.2, y - 1.0), (x + 0.2, y - 1.0), (x + 0.2, y + 1.0), (x - 0.2, y + 1.0))
    return MapZone("lane", ONE_WAY, tuple(Point(*corner, 0.0) for corner in corners), direction=direction)


def test_a_lane_through_the_only_door_has_a_length_one_way() -> None:
    free, along = routes(two_rooms(door=1.2)), routes(two_rooms(door=1.2), lane(4.0, 2.0, 0.0))
    west, east = SE2(2.0, 2.0, 0.0), SE2(6.0, 2.0, 0.0)
    assert along.path_length(west, east) == free.path_length(west, east)
    assert along.path_length(east, west) == np.inf != free.path_length(east, west)
    assert along.has_path(west, east) and along.has_path_to(east, west)
    assert not along.has_path(east, west) and not along.has_path_to(west, east)
    assert along.between(west, east) == free.between(west, east)
    assert along.between(east, west) == DETOUR * east.distance(west)
    along.forget(east)
    assert along.between(west, east) == free.between(west, east), "the table is made again"
