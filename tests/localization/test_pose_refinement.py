"""Tests the refinement of a pose on the likelihood field."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.localization.pose_refinement import _sample, _solve, explained, refine
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

TRUTH = SE2(2.0, 1.5, 0.3)
COVARIANCE = np.diag([0.05**2, 0.05**2, 0.05**2])
ERRORS = st.floats(-0.06, 0.06)


def room() -> LikelihoodField:
    """Return the likelihood field of a room of 4 m by 3 m with walls of one cell."""
    cells = np.zeros((60, 80), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return LikelihoodField.of(Grid(cells, 0.05, 0.0, 0.0), AmclParams())


FIELD = room()


def beams() -> np.ndarray:
    """Return beam ends on the walls in base_link at TRUTH, metres, shape (n, 2)."""
    along_x, along_y = np.arange(0.1, 3.9, 0.1), np.arange(0.1, 2.9, 0.1)
    walls = [
        np.column_stack([along_x, np.full(38, 0.025)]),
        np.column_stack([along_x, np.full(38, 2.975)]),
        np.column_stack([np.full(28, 0.025), along_y]),
        np.column_stack([np.full(28, 3.975), along_y]),
    ]
    return TRUTH.inverse().apply(np.concatenate(walls))


@given(st.integers(0, 2**32 - 1))
def test_the_solver_equals_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3))
    A, b = root @ root.T + 0.1 * np.eye(3), rng.normal(size=3)
    np.testing.assert_allclose(_solve(A, b), np.linalg.solve(A, b), rtol=1e-6, atol=1e-9)


@given(st.floats(0.0, 6.9), st.floats(0.0, 4.9), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_a_linear_field_is_interpolated_exactly(u: float, v: float, a: float, b: float) -> None:
    rows, columns = np.indices((6, 8))
    field = (a * columns + b * rows).astype(np.float32)
    value, slope_x, slope_y = _sample(field, u, v, 20.0)
    assert value == pytest.approx(a * u + b * v, abs=1e-5)
    assert (slope_x, slope_y) == pytest.approx((20.0 * a, 20.0 * b), abs=1e-3)


@given(ERRORS, ERRORS, ERRORS)
@settings(max_examples=40)
def test_refinement_corrects_a_displaced_prior(x: float, y: float, yaw: float) -> None:
    prior = SE2(TRUTH.x + x, TRUTH.y + y, TRUTH.yaw + yaw)
    found = refine(prior, COVARIANCE, beams(), FIELD, 0.05, 0.3)
    assert found.distance(TRUTH) < 0.02
    assert abs(found.yaw - TRUTH.yaw) < 0.01


@given(ERRORS, ERRORS)
def test_without_beams_the_prior_is_kept(x: float, y: float) -> None:
    prior = SE2(TRUTH.x + x, TRUTH.y + y, 0.1)
    assert refine(prior, COVARIANCE, np.empty((0, 2)), FIELD, 0.05, 0.3) == pytest.approx(prior)


def test_a_certain_prior_outweighs_the_beams() -> None:
    prior = SE2(TRUTH.x + 0.05, TRUTH.y, TRUTH.yaw)
    found = refine(prior, np.diag([1e-12] * 3), beams(), FIELD, 0.05, 1e-4)
    assert found.distance(prior) < 0.01


def test_the_explained_share_falls_with_the_error() -> None:
    assert explained(TRUTH, beams(), FIELD, 0.05) == 1.0
    assert explained(SE2(TRUTH.x + 0.5, TRUTH.y, TRUTH.yaw), beams(), FIELD, 0.05) < 0.7
    assert explained(TRUTH, np.empty((0, 2)), FIELD, 0.05) == 0.0
