"""Tests rectangles of cells that grow with the map."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.slam.cell_bounds import EMPTY_BOUNDS, MAX_COORDINATE, CellBounds, MapSizeError, cells_of

PAIRS = st.tuples(st.integers(-50, 50), st.integers(-50, 50)).map(np.array)
SIZES = st.tuples(st.integers(1, 20), st.integers(1, 20)).map(np.array)
BOUNDS = st.builds(lambda begin, size: CellBounds(begin, begin + size), PAIRS, SIZES)


@given(BOUNDS, PAIRS, SIZES, st.integers(0, 5))
def test_expanded_bounds_contain_both_and_grow_only_where_needed(
    bounds: CellBounds, low: np.ndarray, size: np.ndarray, spare: int
) -> None:
    high = low + size - 1
    grown = bounds.expanded(low, high, np.array([spare, spare]))
    assert grown.contains(low, high) and grown.contains(bounds.begin, bounds.end - 1)
    assert np.array_equal(grown.begin == bounds.begin, low >= bounds.begin)
    assert np.array_equal(grown.end == bounds.end, high < bounds.end)


@given(PAIRS, SIZES)
def test_empty_bounds_become_the_given_cells(low: np.ndarray, size: np.ndarray) -> None:
    grown = EMPTY_BOUNDS.expanded(low, low + size - 1, np.zeros(2, np.int64))
    assert grown.shape == (size[1], size[0]) and grown.cells == size.prod()


@given(BOUNDS, SIZES, SIZES, st.integers(0, 99))
def test_copied_cells_keep_their_coordinates(
    bounds: CellBounds, before: np.ndarray, after: np.ndarray, seed: int
) -> None:
    target = CellBounds(bounds.begin - before, bounds.end + after)
    array = np.random.default_rng(seed).integers(1, 9, (2, *bounds.shape))
    copied = bounds.copied_into(array, target)
    column, row = before
    height, width = bounds.shape
    assert copied.shape == (2, *target.shape)
    assert np.array_equal(copied[:, row : row + height, column : column + width], array)
    assert copied.sum() == array.sum()


def test_scaling_and_the_maximum_size() -> None:
    bounds = CellBounds(np.array([-1, 2]), np.array([3, 5]))
    assert bounds.scaled(4).shape == (12, 16)
    assert bounds.check_size(12) is bounds
    with pytest.raises(MapSizeError, match="4 x 3 cells"):
        bounds.check_size(11)


def test_points_are_floored_and_implausible_ones_rejected() -> None:
    assert cells_of(np.array([[-0.5, 1.5]])).tolist() == [[-1, 1]]
    for far in (MAX_COORDINATE, np.nan, -np.inf):
        with pytest.raises(MapSizeError, match="check odometry"):
            cells_of(np.array([[0.0, far]]))
