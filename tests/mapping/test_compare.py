"""Map quality: known maps, known figures."""

import math

import numpy as np
import pytest

from chefbot.mapping.compare import quality
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid


def room(height=120, width=160, resolution=0.05):
    """A room with a wall half through it and a square pillar, unknown outside its walls."""
    cells = np.full((height, width), UNKNOWN, np.int8)
    cells[10:-10, 10:-10] = OCCUPIED
    cells[11:-11, 11:-11] = FREE
    cells[11:70, 80] = OCCUPIED
    cells[85:92, 40:47] = OCCUPIED
    return Grid(cells, resolution, -2.0, 1.0)


def changed(grid, cells):
    return Grid(cells, grid.resolution, grid.origin_x, grid.origin_y)


def test_the_plan_itself_is_perfect():
    result = quality(room(), room())
    assert (result.precision, result.recall, result.explored) == (1.0, 1.0, 1.0)


def test_one_cell_is_tolerated_and_two_are_not():
    truth = room()
    for shift, perfect in ((1, True), (2, False)):
        cells = np.roll(truth.cells, (shift, -shift), axis=(0, 1))
        result = quality(changed(truth, cells), truth)
        assert (result.precision == 1.0 and result.recall == 1.0) == perfect
    assert result.precision < 0.1


def test_the_origin_counts_and_not_the_place_in_the_array():
    truth = room()
    cut = Grid(truth.cells[5:-3, 7:-9], truth.resolution, -2.0 + 7 * 0.05, 1.0 + 5 * 0.05)
    assert quality(cut, truth).precision == quality(cut, truth).recall == 1.0
    shifted = Grid(truth.cells, truth.resolution, -2.0 + 0.5, 1.0)
    assert quality(shifted, truth).precision < 0.6


def test_figures_of_a_map_of_the_left_half():
    truth = room()
    cells = truth.cells.copy()
    cells[:, 60:] = UNKNOWN
    result = quality(changed(truth, cells), truth)
    free = truth.cells == FREE
    assert result.precision == 1.0
    assert result.explored == pytest.approx(free[:, :60].sum() / free.sum())
    assert 0.25 < result.recall < 0.5


def test_phantoms_cost_precision_and_misses_cost_recall():
    truth = room()
    walls = int((truth.cells == OCCUPIED).sum())
    phantom = truth.cells.copy()
    phantom[20:30, 120:130] = OCCUPIED
    result = quality(changed(truth, phantom), truth)
    assert result.precision == pytest.approx(walls / (walls + 100))
    assert result.recall == 1.0
    missing = truth.cells.copy()
    missing[11:70, 80] = FREE
    result = quality(changed(truth, missing), truth)
    assert result.precision == 1.0
    assert 0.8 < result.recall < 0.95


def test_the_inside_of_a_pillar_need_not_be_found():
    truth = room()
    hollow = truth.cells.copy()
    hollow[87:90, 42:45] = UNKNOWN
    assert quality(changed(truth, hollow), truth).recall == 1.0


def test_another_resolution():
    truth = room()
    coarse = Grid(truth.cells[::2, ::2], 0.1, truth.origin_x, truth.origin_y)
    fine = Grid(np.kron(truth.cells, np.ones((2, 2), np.int8)), 0.025, truth.origin_x, truth.origin_y)
    assert quality(fine, truth).precision == 1.0 and quality(fine, truth).recall == 1.0
    assert quality(coarse, truth).precision == 1.0


def test_a_map_of_nothing():
    truth = room()
    empty = changed(truth, np.full_like(truth.cells, UNKNOWN))
    result = quality(empty, truth)
    assert math.isnan(result.precision)
    assert (result.recall, result.explored) == (0.0, 0.0)
