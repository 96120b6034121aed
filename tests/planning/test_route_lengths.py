"""Lengths of routes: around walls, never shorter than the straight line, and estimated beyond the map."""

from __future__ import annotations

import numpy as np
import pytest
from tests.planning.rooms import RESOLUTION, two_rooms

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.planning.route_lengths import DETOUR, RouteLengths
from chefbot.robot.load import load_robot


def routes(grid: Grid) -> RouteLengths:
    costs = LayeredCostmap(CostmapParams(), load_robot("chefbot_lidar").footprint, avoid_unknown=False)
    costs.set_static(grid)
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
