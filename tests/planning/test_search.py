"""Tests the search on maps larger than those that are compared with scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from chefbot.planning.cost_grid import CostGrid
from chefbot.planning.graph_search import search

SIDE, BLOCKED = 200, 255
WEIGHT = np.append(1.0 + 3.0 * np.arange(255) / 254, 0.0).astype(np.float32)
"""Weights from 1 to 4 by cost; 0 where blocked."""


def searched(cells: NDArray[np.uint8], source: int, goal: int) -> tuple[NDArray[np.float32], int, int]:
    """Return cost-to-come, number of cells written, and number of expansions."""
    g, written = np.full(cells.size, np.inf, np.float32), np.empty(cells.size, np.int32)
    grid = CostGrid(cells.reshape(-1), WEIGHT, cells.shape[1], np.zeros(0, np.uint8), np.zeros((1, 2)))
    return g, *search(grid, source, goal, g, written)


def smooth_costs(seed: int) -> NDArray[np.uint8]:
    """Return costs that vary smoothly, with blocked regions and a blocked border."""
    noise = gaussian_filter(np.random.default_rng(seed).random((SIDE, SIDE)), 3.0)
    level = (noise - noise.min()) / (noise.max() - noise.min())
    cells = np.where(level > 0.7, BLOCKED, 254 * level / 0.7).astype(np.uint8)
    cells[[0, -1]] = BLOCKED
    cells[:, [0, -1]] = BLOCKED
    return cells


@pytest.mark.parametrize("column", [10, 30, 110, 130, 150, 170])
def test_no_cell_is_expanded_far_beyond_the_best_cost(column: int) -> None:
    """If buckets were emptied from their end, cells of an open floor would be expanded two to three times."""
    cells = np.full((SIDE, SIDE), BLOCKED, np.uint8)
    cells[1:-1, 1:-1] = 0
    _, written, taken = searched(cells, SIDE + 1, (SIDE - 2) * SIDE + column)
    assert taken < 1.4 * written


@settings(max_examples=30)
@given(st.integers(0, 2**31), st.integers(0, 2**31))
def test_the_goal_cost_equals_that_of_the_full_field(seed: int, ends: int) -> None:
    cells = smooth_costs(seed)
    free = np.flatnonzero(cells < BLOCKED)
    source, goal = np.random.default_rng(ends).choice(free, 2, replace=False)
    field, *_ = searched(cells, source, -1)
    g, written, taken = searched(cells, source, goal)
    assert g[goal] == pytest.approx(field[goal], rel=1e-5)
    assert written == np.isfinite(g).sum()
    assert taken < 1.3 * written
