"""Tests the occupancy accumulator, which counts beam ends and beams through each cell."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.grid import UNKNOWN
from chefbot.maths.se2 import SE2
from chefbot.slam.cell_bounds import MapSizeError
from chefbot.slam.occupancy_accumulator import OccupancyAccumulator
from chefbot.slam.scan_beams import Beams, beams_of

ANGLES = np.linspace(-np.pi, np.pi, 720, endpoint=False).astype(np.float32)
ORIGIN = np.array([0.0, 0.0, 0.0])


def scan_at(world, x: float, y: float, reach: float = 8.0) -> tuple[Beams, np.ndarray]:
    ranges = world.ranges(SE2(x, y, 0), ANGLES, reach)
    return beams_of(ANGLES, ranges, SE2(0, 0, 0), reach, 2.0), np.array([x, y, 0.0])


def accumulate(*scans: tuple[Beams, np.ndarray]) -> OccupancyAccumulator:
    accumulator = OccupancyAccumulator(0.05, 10_000_000)
    for beams, pose in scans:
        accumulator.add_scan(beams, pose)
    return accumulator


def test_walls_are_occupied_and_cells_before_them_free(ring) -> None:
    grid = accumulate(scan_at(ring, 1.3, 1.3)).grid()
    assert grid.at(-0.001, 1.3) > 65 or grid.at(0.001, 1.3) > 65
    assert grid.at(1.3, 2.0) < 25
    assert grid.at(0.3, 1.3) < 25
    assert grid.at(6.0, 4.0) == UNKNOWN
    assert grid.at(-1.0, -1.0) == UNKNOWN


def test_beam_ends_are_occupied_although_other_beams_graze_them(ring) -> None:
    beams, pose = scan_at(ring, 1.3, 1.3)
    grid = accumulate((beams, pose)).grid()
    for x, y in beams.surfaces + pose[:2]:
        assert grid.at(float(x), float(y)) > 65


@settings(max_examples=15)
@given(st.permutations([(1.3, 1.3), (5, 1.2), (10.6, 1.4), (10.6, 6.5), (1.4, 6.6)]))
def test_scan_order_does_not_matter(order) -> None:
    from tests.slam.conftest import RING, World

    world = World.of(RING)
    first = accumulate(*[scan_at(world, x, y) for x, y in sorted(order)]).grid()
    again = accumulate(*[scan_at(world, x, y) for x, y in order]).grid()
    assert np.array_equal(first.cells, again.cells)
    assert (first.origin_x, first.origin_y) == (again.origin_x, again.origin_y)


def test_a_person_who_left_is_erased(ring) -> None:
    empty = scan_at(ring, 1.3, 1.3)
    person = Beams(np.zeros(2, np.float32), np.array([[1.0, 0.0]], np.float32), np.array([True]))
    once = accumulate((person, empty[1])).grid()
    assert once.at(2.3, 1.3) > 65
    assert accumulate((person, empty[1]), *[empty] * 4).grid().at(2.3, 1.3) < 25


def test_a_copied_accumulator_is_independent(ring) -> None:
    accumulator = accumulate(scan_at(ring, 1.3, 1.3))
    before = accumulator.grid()
    accumulator.copy().add_scan(*scan_at(ring, 10.6, 6.5))
    assert np.array_equal(accumulator.grid().cells, before.cells)


def test_an_implausible_map_size_is_rejected() -> None:
    far = Beams(np.zeros(2, np.float32), np.array([[1e4, 1e4]], np.float32), np.array([True]))
    with pytest.raises(MapSizeError, match="max_cells"):
        OccupancyAccumulator(0.05, 1_000_000).add_scan(far, ORIGIN)


def test_an_empty_accumulator_is_one_unknown_cell() -> None:
    assert OccupancyAccumulator(0.05, 10_000).grid().cells.tolist() == [[UNKNOWN]]
