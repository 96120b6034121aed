"""Tests the smoothing of paths: line integrals, shortcuts, resampling and relaxation."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.planning.cost_grid import CostGrid
from chefbot.planning.smoothing import line_cost, pull, relax, resample, with_headings

STRIDE, BLOCKED = 22, 255
WEIGHT = np.append(1.0 + 4.0 * np.arange(255) / 254, 0.0).astype(np.float32)
"""Weights from 1 to 5 by cost; 0 where blocked."""
INNER = st.floats(1.001, 20.999)
SEEDS = st.integers(0, 2**32 - 1)


def grid_of(inner: np.ndarray | int) -> CostGrid:
    """Return a grid (22, 22) of these costs with a blocked border, without lanes."""
    cells = np.full((STRIDE, STRIDE), BLOCKED, np.uint8)
    cells[1:-1, 1:-1] = inner
    return CostGrid(cells.reshape(-1), WEIGHT, STRIDE, np.zeros(0, np.uint8), np.zeros((1, 2)))


def random_grid(seed: int) -> CostGrid:
    return grid_of(np.random.default_rng(seed).integers(0, BLOCKED, (STRIDE - 2, STRIDE - 2)))


def total(grid: CostGrid, points: np.ndarray) -> float:
    return sum(line_cost(grid, *a, *b) for a, b in pairwise(points))


@given(SEEDS, INNER, INNER, INNER, INNER)
def test_line_cost_is_the_integral_of_the_weight(
    seed: int, x0: float, y0: float, x1: float, y1: float
) -> None:
    grid = random_grid(seed)
    t = (np.arange(4000) + 0.5) / 4000
    columns, rows = np.floor(x0 + t * (x1 - x0)), np.floor(y0 + t * (y1 - y0))
    sampled = WEIGHT[grid.cells[(rows * STRIDE + columns).astype(int)]].mean() * math.hypot(x1 - x0, y1 - y0)
    assert line_cost(grid, x0, y0, x1, y1) == pytest.approx(sampled, rel=0.01, abs=0.05)


@given(SEEDS, INNER, INNER, INNER, INNER)
def test_line_cost_is_the_same_in_both_directions(
    seed: int, x0: float, y0: float, x1: float, y1: float
) -> None:
    grid = random_grid(seed)
    there, back = (
        line_cost(grid, x0, y0, x1, y1),
        line_cost(grid, x1, y1, x0, y0),
    )
    assert there == pytest.approx(back, rel=1e-6, abs=1e-6)


def test_a_line_through_a_blocked_cell_has_infinite_cost() -> None:
    grid = random_grid(1)
    grid.cells[10 * STRIDE + 10] = BLOCKED
    assert line_cost(grid, 5.5, 10.5, 15.5, 10.5) == math.inf
    assert line_cost(grid, 5.5, 11.5, 15.5, 11.5) < math.inf


def staircase(n: int) -> np.ndarray:
    """Return the cells of a 4-connected staircase from (1, 1)."""
    steps = [(1 + i // 2, 1 + (i + 1) // 2) for i in range(n)]
    return np.array([r * STRIDE + c for r, c in steps])


@given(SEEDS, st.integers(3, 36))
def test_shortcuts_never_cost_more_than_the_chain(seed: int, n: int) -> None:
    grid, chain = random_grid(seed), staircase(n)
    centres = np.column_stack([chain % STRIDE + 0.5, chain // STRIDE + 0.5])
    g = np.full(grid.cells.shape, np.inf, np.float32)
    g[chain] = np.concatenate([[0.0], np.cumsum([total(grid, centres[i : i + 2]) for i in range(n - 1)])])
    kept = pull(grid, g, chain)
    assert kept[0] == 0 and kept[-1] == n - 1 and (np.diff(kept) > 0).all()
    assert total(grid, centres[kept]) <= float(g[chain[-1]]) * 1.001


def test_on_uniform_costs_the_staircase_becomes_one_line() -> None:
    grid = grid_of(0)
    chain = staircase(30)
    g = np.full(grid.cells.size, np.inf, np.float32)
    g[chain] = np.arange(30)
    assert len(pull(grid, g, chain)) <= 3


@given(SEEDS, st.integers(2, 8), st.floats(0.05, 2.0))
def test_resampling_keeps_corners_and_length(seed: int, n: int, spacing: float) -> None:
    points = np.random.default_rng(seed).uniform(0, 5, (n, 2))
    dense = resample(points, spacing)
    steps = np.hypot(*np.diff(dense, axis=0).T)
    assert steps.max() <= spacing * (1 + 1e-5)
    assert steps.sum() == pytest.approx(np.hypot(*np.diff(points, axis=0).T).sum())
    gaps = np.hypot(*(points[:, None] - dense[None]).transpose(2, 0, 1)).min(axis=1)
    assert gaps.max() < 1e-9


@given(SEEDS)
def test_relaxation_never_raises_the_cost_and_keeps_the_ends(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid, points = random_grid(seed), rng.uniform(1.5, 20.5, (12, 2))
    before, ends, cost = points.copy(), points[[0, -1]].copy(), total(grid, points)
    relax(grid, points, 3)
    assert np.array_equal(points[[0, -1]], ends)
    assert total(grid, points) <= cost * (1 + 1e-6)
    assert not np.array_equal(points, before)


def test_headings_face_the_next_point() -> None:
    poses = with_headings(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]), -0.5)
    assert poses[:, 2] == pytest.approx([0.0, math.pi / 2, -0.5])
