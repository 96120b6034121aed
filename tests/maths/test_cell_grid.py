"""Cells and points of a grid."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.cell_grid import CellGrid

CELLS = np.arange(12).reshape(3, 4)
GRIDS = st.builds(
    CellGrid, st.just(CELLS), st.floats(0.01, 1.0), st.floats(-10.0, 10.0), st.floats(-10.0, 10.0)
)


@given(GRIDS, st.integers(-5, 8), st.integers(-5, 8))
def test_the_centre_of_a_cell_lies_in_that_cell(grid: CellGrid, row: int, column: int) -> None:
    assert grid.cell(*grid.centre(row, column)) == (row, column)
    assert grid.contains(*grid.centre(row, column)) == (0 <= row < 3 and 0 <= column < 4)


@given(GRIDS, st.lists(st.tuples(st.integers(-5, 8), st.integers(-5, 8)), min_size=1, max_size=9))
def test_values_of_many_points_equal_those_of_each(grid: CellGrid, cells: list[tuple[int, int]]) -> None:
    points = np.array([grid.centre(*cell) for cell in cells])
    found = grid.values(points[:, 0], points[:, 1], -1)
    assert found.tolist() == [grid.value(x, y, -1) for x, y in points]
    expected = [CELLS[r, c] if 0 <= r < 3 and 0 <= c < 4 else -1 for r, c in cells]
    assert found.tolist() == expected


def test_rows_are_the_height_and_columns_the_width() -> None:
    grid = CellGrid(CELLS, 0.5, 0.0, 0.0)
    assert (grid.height, grid.width) == (3, 4)
    assert grid.value(1.9, 1.4, -1) == 11
