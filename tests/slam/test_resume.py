"""Tests that a restarted mapper resumes with the map that was published before the restart."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tests.support.beam_angles import LIDAR

from chefbot.maths.grid import UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY
from chefbot.slam import Gmapping, GmappingParams
from chefbot.slam.occupancy_accumulator import OccupancyAccumulator

OCCUPANCY = st.sampled_from([UNKNOWN, 1, 3, 9, 24, 50, 76, 91, 97, 99])
"""Occupancies of cells after a few scans."""


@given(arrays(np.int8, (5, 7), elements=OCCUPANCY), st.integers(-50, 50), st.integers(-50, 50))
def test_an_accumulator_restored_from_a_grid_shows_it(cells, column: int, row: int) -> None:
    accumulator = OccupancyAccumulator(0.05, 10_000)
    accumulator.initialize_from(Grid(cells, 0.05, 0.05 * column, 0.05 * row))
    shown = accumulator.grid()
    assert (shown.origin_x, shown.origin_y) == (pytest.approx(0.05 * column), pytest.approx(0.05 * row))
    assert np.array_equal(shown.cells == UNKNOWN, cells == UNKNOWN)
    assert np.array_equal(shown.cells >= 50, cells >= 50)
    assert np.abs(shown.cells.astype(int) - cells).max() <= 6


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_mapping_resumes_after_a_restart(ring, drive, odometry, seed: int) -> None:
    truth = drive(1.25)
    odom = odometry(truth, seed, 0.02, 0.02, 0.01)
    params = GmappingParams(particles=15, seed=seed)
    rng = np.random.default_rng(9)
    slam, half = Gmapping(params), len(truth) // 2
    for i, (true, wheel) in enumerate(zip(truth, odom, strict=True)):
        if i == half:
            published, pose = slam.map(), slam.map_T_odom @ wheel
            slam = Gmapping(params, IDENTITY, pose)
            slam.resume(published)
        ranges = ring.ranges(true, LIDAR, 8.0) + rng.normal(0, 0.01, len(LIDAR)).astype(np.float32)
        slam.update(LIDAR, ranges.astype(np.float32), wheel)
    assert truth[0].between(truth[-1]).distance(slam.pose) < 0.1
    whole = slam.map()
    assert whole.width * whole.height >= 0.9 * published.width * published.height
    x, y = truth[0].inverse().apply(np.array([[6.0, 2.5], [1.4, 4.0], [6.0, 0.0]])).T
    seen = [whole.at(float(a), float(b)) for a, b in zip(x, y, strict=True)]
    assert seen[1] < 25
