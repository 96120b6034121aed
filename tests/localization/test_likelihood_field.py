"""Tests the likelihood field against its definition, calculated beam by beam."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt

from chefbot.localization.errors import LocalizationError
from chefbot.localization.likelihood_field import PAD, LikelihoodField, log_likelihood
from chefbot.localization.params import AmclParams
from chefbot.maths.grid import Grid

PARAMS = AmclParams(laser_likelihood_max_dist=0.5)


def random_grid(seed: int, height: int, width: int, occupied: float) -> Grid:
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((height, width)) < occupied, 100, 0).astype(np.int8)
    cells[rng.random((height, width)) < 0.2] = -1
    cells[0, 0], cells[-1, -1] = 100, 0
    return Grid(cells, 0.05, -1.3, 2.7)


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.integers(2, 40), st.integers(2, 40), st.floats(0.0, 0.2))
def test_distances_equal_the_euclidean_transform(seed: int, height: int, width: int, occupied: float) -> None:
    grid = random_grid(seed, height, width, occupied)
    field = LikelihoodField.of(grid, PARAMS)
    exact = distance_transform_edt(grid.cells < 65) * grid.resolution
    inner = field.distance[PAD:-PAD, PAD:-PAD]
    np.testing.assert_allclose(inner, np.minimum(exact, PARAMS.laser_likelihood_max_dist), atol=1e-6)


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_the_kernel_adds_the_log_likelihood_of_each_beam(seed: int) -> None:
    grid = random_grid(seed, 30, 50, 0.05)
    field = LikelihoodField.of(grid, PARAMS)
    rng = np.random.default_rng(seed)
    # some beams end far off the map on all sides
    particles = np.stack([rng.uniform(-3, 3, 20), rng.uniform(1, 6, 20), rng.uniform(-9, 9, 20)], axis=1)
    points = rng.uniform(-3, 3, (12, 2))
    border = 0
    expected = np.zeros(20)
    for i, (x, y, yaw) in enumerate(particles):
        for px, py in points:
            wx = x + math.cos(yaw) * px - math.sin(yaw) * py
            wy = y + math.sin(yaw) * px + math.cos(yaw) * py
            cell = [(wx - grid.origin_x) / grid.resolution, (wy - grid.origin_y) / grid.resolution]
            border += any(abs(c - round(c)) < 1e-3 for c in cell)
            row, col = grid.cell(wx, wy)
            inside = 0 <= row < grid.height and 0 <= col < grid.width
            far = PARAMS.laser_likelihood_max_dist
            d = field.distance[row + PAD, col + PAD] if inside else far
            expected[i] += log_likelihood(np.array([d], np.float64), PARAMS)[0]
    got = field.log_likelihoods(particles, points)
    assert (np.abs(got - expected) > 1e-3).sum() <= border


def test_a_perfect_hit_scores_zero_and_an_outlier_the_floor() -> None:
    far = log_likelihood(np.array([0.0, 0.1, 50.0]), PARAMS)
    assert far[0] == 0.0
    assert far[2] == pytest.approx(math.log(PARAMS.z_rand / (PARAMS.z_hit + PARAMS.z_rand)))
    assert far[2] < far[1] < far[0]


def test_global_poses_cover_all_free_cells() -> None:
    grid = random_grid(4, 12, 17, 0.3)
    field = LikelihoodField.of(grid, PARAMS)
    poses = field.sample_free_space(40_000, np.random.default_rng(1))
    rows, cols = zip(*(grid.cell(x, y) for x, y, _ in poses), strict=True)
    counts = np.zeros((12, 17))
    np.add.at(counts, (rows, cols), 1)
    free = grid.cells == 0
    assert not counts[~free].any()
    mean = 40_000 / free.sum()
    assert np.abs(counts[free] - mean).max() < 5.5 * math.sqrt(mean)
    assert abs(np.exp(1j * poses[:, 2]).mean()) < 0.02


@pytest.mark.parametrize(("value", "missing"), [(100, "free"), (-1, "free"), (0, "occupied")])
def test_a_map_without_free_or_occupied_cells_is_rejected(value: int, missing: str) -> None:
    with pytest.raises(LocalizationError, match=f"no {missing} cell"):
        LikelihoodField.of(Grid(np.full((5, 5), value, np.int8), 0.05, 0.0, 0.0), PARAMS)
    with pytest.raises(LocalizationError, match="no free cell"):
        LikelihoodField.of(Grid(np.zeros((0, 0), np.int8), 0.05, 0.0, 0.0), PARAMS)
