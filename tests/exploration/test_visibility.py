"""Lines of sight on a partially known map."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.exploration.params import ExplorerParams
from chefbot.exploration.visibility import best_view, nearest_reachable, sees, unknown_in_view

OCCUPIED = ExplorerParams().occupied_threshold
CELL = st.integers(0, 19)


def room(seed: int | None = None, share: float = 0.1) -> np.ndarray:
    cells = np.zeros((20, 20), np.int8)
    if seed is not None:
        cells[np.random.default_rng(seed).random((20, 20)) < share] = 100
    return cells


@given(CELL, CELL, CELL, CELL)
def test_in_an_empty_room_every_cell_sees_every_cell(r0: int, c0: int, r1: int, c1: int) -> None:
    assert sees(room(), OCCUPIED, r0, c0, r1, c1)


@pytest.mark.parametrize("value", [100, -1])
def test_walls_and_unknown_cells_block_the_line_of_sight(value: int) -> None:
    cells = room()
    cells[:, 10] = value
    assert not sees(cells, OCCUPIED, 5, 2, 8, 18)
    assert sees(cells, OCCUPIED, 5, 2, 8, 10), "the target cell itself does not count"


@given(st.integers(0, 99), CELL, CELL, st.floats(-3.0, 3.0), st.floats(0.2, 6.2))
def test_each_unknown_cell_in_view_counts_once(
    seed: int, row: int, column: int, yaw: float, field: float
) -> None:
    cells = room(seed)
    cells[10:, 10:] = -1
    reach = 8.0
    r, c = np.nonzero(cells < 0)
    near = np.hypot(r - row, c - column) <= reach + 1.5
    count = unknown_in_view(cells, OCCUPIED, row, column, yaw, field, reach)
    assert 0 <= count <= np.count_nonzero(near)
    assert count <= unknown_in_view(cells, OCCUPIED, row, column, yaw, 2 * math.pi, reach) + 8


def test_a_full_turn_counts_the_disc_and_a_wall_hides_cells() -> None:
    cells = np.full((41, 41), -1, np.int8)
    count = unknown_in_view(cells, OCCUPIED, 20, 20, 0.0, 2 * math.pi, 10.0)
    assert count == pytest.approx(math.pi * 100, rel=0.1)
    cells[:, 22] = 100
    assert unknown_in_view(cells, OCCUPIED, 20, 20, 0.0, 0.5, 10.0) <= 4


@given(st.integers(0, 99), CELL, CELL, st.integers(1, 8))
def test_the_best_view_is_the_cheapest_cell_that_sees_the_target(
    seed: int, row: int, column: int, reach: int
) -> None:
    cells = room(seed)
    cost = np.random.default_rng(seed + 1).random((20, 20)).astype(np.float32)
    cost[cells > 0] = np.inf
    candidates = [
        (cost[r, c], r, c)
        for r in range(20)
        for c in range(20)
        if np.isfinite(cost[r, c])
        and (r - row) ** 2 + (c - column) ** 2 <= reach**2
        and sees(cells, OCCUPIED, r, c, row, column)
    ]
    expected = min(candidates)[1:] if candidates else (-1, -1)
    assert best_view(cells, cost, OCCUPIED, row, column, reach) == expected


@given(st.integers(0, 99), CELL, CELL, st.integers(1, 12))
def test_the_nearest_reachable_cell_is_within_reach(seed: int, row: int, column: int, reach: int) -> None:
    cost = np.where(np.random.default_rng(seed).random((20, 20)) < 0.05, 1.0, np.inf).astype(np.float32)
    r, c = np.nonzero(np.isfinite(cost))
    squared = (r - row) ** 2 + (c - column) ** 2
    found = nearest_reachable(cost, row, column, reach)
    if len(squared) == 0 or squared.min() > reach**2:
        assert found is None
    else:
        assert found is not None and math.dist(found, (row, column)) ** 2 == pytest.approx(squared.min())
