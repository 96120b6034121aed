"""Tests the search on maps larger than those that are compared with scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from chefbot.planning.graph_search import search

SIDE = 200
NONE = np.zeros(0, np.uint8), np.zeros((1, 2))
"""No one-way lanes."""


def searched(weight: NDArray[np.float32], source: int, goal: int) -> tuple[NDArray[np.float32], int, int]:
    """Return cost-to-come, number of cells written, and number of expansions."""
    g, written = np.full(weight.size, np.inf, np.float32), np.empty(weight.size, np.int32)
    return g, *search(weight.reshape(-1), 4.0, weight.shape[1], source, goal, g, written, *NONE)


def smooth_weights(seed: int) -> NDArray[np.float32]:
    """Return weights from 1 to 4 that vary smoothly, with blocked regions and a blocked border."""
    noise = gaussian_filter(np.random.default_rng(seed).random((SIDE, SIDE)), 3.0)
    level = (noise - noise.min()) / (noise.max() - noise.min())
    weight = np.where(level > 0.7, 0.0, 1.0 + 3.0 * level / 0.7).astype(np.float32)
    weight[[0, -1]] = 0.0
    weight[:, [0, -1]] = 0.0
    return weight


@pytest.mark.parametrize("column", [10, 30, 110, 130, 150, 170])
def test_no_cell_is_expanded_far_beyond_the_best_cost(column: int) -> None:
    """If buckets were emptied from their end, cells of an open floor would be expanded two to three times."""
    weight = np.zeros((SIDE, SIDE), np.float32)
    weight[1:-1, 1:-1] = 1.0
    _, written, taken = searched(weight, SIDE + 1, (SIDE - 2) * SIDE + column)
    assert taken < 1.4 * written


@settings(max_examples=30)
@given(st.integers(0, 2**31), st.integers(0, 2**31))
def test_the_goal_cost_equals_that_of_the_full_field(seed: int, ends: int) -> None:
    weight = smooth_weights(seed)
    source, goal = np.random.default_rng(ends).choice(np.flatnonzero(weight), 2, replace=False)
    field, *_ = searched(weight, source, -1)
    g, written, taken = searched(weight, source, goal)
    assert g[goal] == pytest.approx(field[goal], rel=1e-5)
    assert written == np.isfinite(g).sum()
    assert taken < 1.3 * written
