"""The changed part of a map."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from chefbot.mapping.map_patch import changed_part
from chefbot.maths.grid import Grid

CELLS = st.sampled_from([-1, 0, 50, 100])
PAIRS = hnp.array_shapes(min_dims=2, max_dims=2, max_side=12).flatmap(
    lambda shape: st.tuples(*[hnp.arrays(np.int8, shape, elements=CELLS) for _ in range(2)])
)


@given(pair=PAIRS)
def test_a_patch_turns_the_earlier_map_into_the_present_one(pair: tuple[np.ndarray, np.ndarray]) -> None:
    before, now = (Grid(cells, 0.05, -1.0, 2.0) for cells in pair)
    patch = changed_part(before, now)
    assert patch is not None
    patched = before.cells.copy()
    rows, columns = patch.cells.shape
    patched[patch.row : patch.row + rows, patch.column : patch.column + columns] = patch.cells
    assert np.array_equal(patched, now.cells)
    if rows:  # no smaller rectangle would do
        differs = before.cells != now.cells
        assert differs[patch.row].any() and differs[patch.row + rows - 1].any()
        assert differs[:, patch.column].any() and differs[:, patch.column + columns - 1].any()


def test_a_map_of_other_cells_has_no_patch() -> None:
    grid = Grid(np.zeros((4, 6), np.int8), 0.05, 0.0, 0.0)
    for other in (
        Grid(np.zeros((4, 7), np.int8), 0.05, 0.0, 0.0),
        Grid(grid.cells, 0.1, 0.0, 0.0),
        Grid(grid.cells, 0.05, 0.05, 0.0),
        Grid(grid.cells, 0.05, 0.0, -0.05),
    ):
        assert changed_part(grid, other) is None
