"""Tests the costs near unknown space and the incremental merge of the layers."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.costmap.inflation import inflate
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.unknown_space import cells_near_unknown
from chefbot.maths.costs import FREE, LETHAL, UNKNOWN
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

SHAPE = (24, 30)


def layered(static: np.ndarray, unseen: float, track: bool) -> LayeredCostmap:
    """Return a costmap with cells of 1 m whose robot keeps `unseen` metres from unknown space."""
    params = CostmapParams(padding=0.0, inflation_radius=4.0, track_unknown=track)
    costs = LayeredCostmap(params, disc(max(unseen, 0.1)), avoid_unknown=unseen > 0.0)
    occupancy = np.select([static == LETHAL, static == UNKNOWN], [100, -1], 0).astype(np.int8)
    costs.set_static(Grid(occupancy, 1.0, 0.0, 0.0))
    return costs


@given(st.integers(0, 999), st.floats(1.0, 4.0))
@settings(max_examples=30)
def test_cells_near_large_unknown_regions_are_found(seed: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    cells = np.zeros(SHAPE, np.uint8)
    r, c = rng.integers(0, 14), rng.integers(0, 20)
    cells[r : r + 9, c : c + 9] = UNKNOWN
    cells[-1, -1] = UNKNOWN  # a gap between beams
    rows, columns = np.indices(SHAPE)
    region = (rows >= r) & (rows < r + 9) & (columns >= c) & (columns < c + 9)
    near = np.zeros(SHAPE, bool)
    for a, b in zip(*np.nonzero(region), strict=True):
        near |= (rows - a) ** 2 + (columns - b) ** 2 <= radius**2 + 1e-9
    large_gap = math.pi * radius**2 <= 1
    assert not large_gap
    joined = region[-1, -1] or region[-2:, -2:].any()
    if not joined:
        assert np.array_equal(cells_near_unknown(cells, radius), near & (cells != UNKNOWN))


def test_a_small_gap_is_ignored() -> None:
    cells = np.zeros(SHAPE, np.uint8)
    cells[5, 5] = UNKNOWN
    assert not cells_near_unknown(cells, 2.0).any()


@given(st.integers(0, 999), st.sampled_from([0.0, 2.0]), st.booleans())
@settings(max_examples=40)
def test_incremental_updates_equal_a_full_recalculation(seed: int, unseen: float, track: bool) -> None:
    rng = np.random.default_rng(seed)
    static = rng.choice(np.array([FREE, FREE, FREE, LETHAL, UNKNOWN], np.uint8), SHAPE)
    costs = layered(static, unseen, track)
    costs.update()
    marks = costs.source_cells("laser")
    for _ in range(5):
        r, c = int(rng.integers(0, 20)), int(rng.integers(0, 26))
        marks[r : r + 3, c : c + 3] = rng.choice(np.array([FREE, LETHAL, UNKNOWN], np.uint8))
        costs.note_change(SE2(c + 1.5, r + 1.5, 0.0), 2.2)
        updated = costs.update()
    full = layered(static, unseen, track)
    full.source_cells("laser")[:] = marks
    assert np.array_equal(updated.cells, full.update().cells)


def test_layers_overwrite_free_space_and_fill_unknown_cells() -> None:
    static = np.array([[FREE, FREE, UNKNOWN, UNKNOWN, LETHAL]], np.uint8)
    costs = layered(static, 0.0, True)
    costs.source_cells("laser")[:] = np.array([[LETHAL, UNKNOWN, FREE, UNKNOWN, FREE]], np.uint8)
    costs.layers = costs.layers[:-1]  # without inflation
    assert costs.update().cells.tolist() == [[LETHAL, FREE, FREE, UNKNOWN, LETHAL]]
    assert inflate(static, np.array([LETHAL], np.uint8))[0, 4] == LETHAL
