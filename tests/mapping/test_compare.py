"""Tests map quality and alignment with maps of known errors and known displacements."""

import math

import numpy as np
import pytest

from chefbot.mapping.compare import align, compare, quality
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY, SE2


def room(height=120, width=160, resolution=0.05):
    """Return a room with a partition wall and a square pillar, unknown outside its walls."""
    cells = np.full((height, width), UNKNOWN, np.int8)
    cells[10:-10, 10:-10] = OCCUPIED
    cells[11:-11, 11:-11] = FREE
    cells[11:70, 80] = OCCUPIED
    cells[85:92, 40:47] = OCCUPIED
    return Grid(cells, resolution, -2.0, 1.0)


def transform_map(grid, truth_T_map):
    """Return the map of a robot whose map frame differs from that of the truth."""
    padding, finer = 20, 3
    out = Grid(
        np.full((grid.height + 2 * padding, grid.width + 2 * padding), UNKNOWN, np.int8),
        grid.resolution,
        grid.origin_x - padding * grid.resolution,
        grid.origin_y - padding * grid.resolution,
    )
    for value in (FREE, OCCUPIED):  # occupied cells overwrite free ones
        row, column = np.nonzero(np.kron(grid.cells == value, np.ones((finer, finer), bool)))
        points = np.column_stack([column + 0.5, row + 0.5]) * grid.resolution / finer
        points = truth_T_map.inverse().apply(points + np.array([grid.origin_x, grid.origin_y]))
        x, y = np.floor((points - (out.origin_x, out.origin_y)) / out.resolution).astype(int).T
        out.cells[y, x] = value
    return out


def with_cells(grid, cells):
    return Grid(cells, grid.resolution, grid.origin_x, grid.origin_y)


def test_the_plan_compared_with_itself_is_perfect():
    result = compare(room(), room())
    assert result.as_is == result.aligned
    assert (result.as_is.precision, result.as_is.recall, result.as_is.explored) == (1.0, 1.0, 1.0)
    assert result.alignment == pytest.approx(IDENTITY, abs=1e-12)


def test_one_cell_of_offset_is_tolerated_and_two_are_not():
    truth = room()
    for shift, perfect in ((1, True), (2, False)):
        cells = np.roll(truth.cells, (shift, -shift), axis=(0, 1))
        result = quality(with_cells(truth, cells), truth)
        assert (result.precision == 1.0 and result.recall == 1.0) == perfect
    assert result.precision < 0.1


def test_maps_are_compared_by_origin_not_by_array_index():
    truth = room()
    cut = Grid(truth.cells[5:-3, 7:-9], truth.resolution, -2.0 + 7 * 0.05, 1.0 + 5 * 0.05)
    assert quality(cut, truth).precision == quality(cut, truth).recall == 1.0
    shifted = Grid(truth.cells, truth.resolution, -2.0 + 0.5, 1.0)
    assert quality(shifted, truth).precision < 0.6


def test_a_map_of_the_left_half_scores_its_explored_share():
    truth = room()
    cells = truth.cells.copy()
    cells[:, 60:] = UNKNOWN
    result = quality(with_cells(truth, cells), truth)
    free = truth.cells == FREE
    assert result.precision == 1.0
    assert result.explored == pytest.approx(free[:, :60].sum() / free.sum())
    assert 0.25 < result.recall < 0.5


def test_false_walls_lower_precision_and_missing_lower_recall():
    truth = room()
    walls = int((truth.cells == OCCUPIED).sum())
    phantom = truth.cells.copy()
    phantom[20:30, 120:130] = OCCUPIED
    result = quality(with_cells(truth, phantom), truth)
    assert result.precision == pytest.approx(walls / (walls + 100))
    assert result.recall == 1.0
    missing = truth.cells.copy()
    missing[11:70, 80] = FREE
    result = quality(with_cells(truth, missing), truth)
    assert result.precision == 1.0
    assert 0.8 < result.recall < 0.95


def test_the_inside_of_a_pillar_may_stay_unknown():
    truth = room()
    hollow = truth.cells.copy()
    hollow[87:90, 42:45] = UNKNOWN
    assert quality(with_cells(truth, hollow), truth).recall == 1.0


def test_only_explorable_cells_count():
    truth = room()
    mask = np.zeros_like(truth.cells, dtype=bool)
    mask[11:-11, 11:60] = truth.cells[11:-11, 11:60] == FREE
    cells = truth.cells.copy()
    cells[:, 61:] = UNKNOWN
    result = quality(with_cells(truth, cells), truth, mask)
    assert (result.explored, result.recall) == (1.0, 1.0)


def test_maps_of_different_resolution_compare():
    truth = room()
    coarse = Grid(truth.cells[::2, ::2], 0.1, truth.origin_x, truth.origin_y)
    fine = Grid(np.kron(truth.cells, np.ones((2, 2), np.int8)), 0.025, truth.origin_x, truth.origin_y)
    assert quality(fine, truth).precision == 1.0 and quality(fine, truth).recall == 1.0
    assert quality(coarse, truth).precision == 1.0


def test_an_empty_map_has_no_recall_and_undefined_precision():
    truth = room()
    empty = with_cells(truth, np.full_like(truth.cells, UNKNOWN))
    result = compare(empty, truth)
    assert math.isnan(result.as_is.precision)
    assert (result.as_is.recall, result.as_is.explored) == (0.0, 0.0)
    assert result.alignment == IDENTITY


def test_a_mask_of_another_shape_is_rejected():
    with pytest.raises(ValueError, match="mask"):
        quality(room(), room(), np.ones((3, 3), dtype=bool))


@pytest.mark.parametrize(
    "offset",
    [SE2(0.12, -0.07, 0.02), SE2(-0.2, 0.2, -0.03), SE2(0.0, 0.0, 0.05), SE2(0.3, 0.0, 0.0)],
)
def test_a_displaced_map_is_aligned_and_both_scores_given(offset):
    truth = room()
    drawn = transform_map(truth, offset)
    result = compare(drawn, truth)
    # compare positions of walls, as yaw about a distant origin also moves them
    for corner in ([-1.5, 1.5], [5.5, 6.5], [2.0, 1.5]):
        there = offset.apply(np.array([corner])) - result.alignment.apply(np.array([corner]))
        assert np.hypot(*there[0]) < 0.04
    assert result.alignment.yaw == pytest.approx(offset.yaw, abs=0.005)
    assert result.aligned.precision > 0.97 and result.aligned.recall > 0.97
    assert result.as_is.precision < result.aligned.precision


def test_alignment_is_deterministic_and_small():
    rng = np.random.default_rng(0)
    noise = rng.choice(np.array([FREE, OCCUPIED], np.int8), p=[0.9, 0.1], size=(80, 80))
    grid = Grid(noise, 0.05, 3.0, 3.0)
    first, second = align(grid, room()), align(grid, room())
    assert first == second
    assert abs(first.yaw) <= math.radians(4.0) + 1e-12
