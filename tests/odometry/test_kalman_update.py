"""Tests the compiled Kalman update against its formulas in numpy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chefbot.odometry.kalman_update import ALL, cholesky, correct, distance, forget, whiten
from chefbot.odometry.motion_model import SIZE

SEEDS = st.integers(0, 2**32 - 1)
MEASURED = st.integers(1, 4)


def positive_definite(rng: np.random.Generator, size: int) -> np.ndarray:
    root = rng.normal(size=(size, size))
    return root @ root.T + 0.1 * np.eye(size)


def problem(seed: int, m: int) -> tuple[np.ndarray, ...]:
    """Return state (n,), covariance (n, n), innovation (m,), H (m, n) and R (m, m)."""
    rng = np.random.default_rng(seed)
    H = rng.normal(size=(m, SIZE)) * (rng.random((m, SIZE)) < 0.4)
    covariance, noise = positive_definite(rng, SIZE), positive_definite(rng, m)
    return rng.normal(size=SIZE), covariance, rng.normal(size=m), H, noise


@given(SEEDS, st.integers(1, 6))
def test_cholesky_and_whitening_equal_those_of_numpy(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    matrix, values = positive_definite(rng, m), rng.normal(size=(m, 3))
    lower = cholesky(matrix)
    np.testing.assert_allclose(lower, np.linalg.cholesky(matrix), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(whiten(lower, values), np.linalg.solve(lower, values), rtol=1e-8, atol=1e-9)


def test_cholesky_of_an_indefinite_matrix_is_not_finite() -> None:
    assert not np.isfinite(cholesky(np.diag([1.0, -1.0]))).all()


@given(SEEDS, MEASURED)
def test_update_equals_the_textbook_formula(seed: int, m: int) -> None:
    state, P, y, H, R = problem(seed, m)
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    corrected, covariance = correct(state, P, y, H, R, ALL)
    np.testing.assert_allclose(corrected, state + K @ y, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(covariance, P - K @ S @ K.T, rtol=1e-6, atol=1e-7)
    squared, innovation_covariance = distance(P, y, H, R)
    np.testing.assert_allclose(innovation_covariance, S, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(squared, y @ np.linalg.solve(S, y), rtol=1e-6)


@given(SEEDS, MEASURED)
def test_covariance_stays_symmetric_and_positive_definite(seed: int, m: int) -> None:
    state, P, y, H, R = problem(seed, m)
    covariance = correct(state, P, y, H, R, ALL)[1]
    assert np.array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert np.linalg.eigvalsh(P - covariance).min() > -1e-9, "a measurement never adds uncertainty"


@given(SEEDS, MEASURED, st.lists(st.booleans(), min_size=SIZE, max_size=SIZE))
def test_consider_states_keep_mean_and_variance(seed: int, m: int, flags: list[bool]) -> None:
    state, P, y, H, R = problem(seed, m)
    estimated = np.array(flags)
    corrected, covariance = correct(state, P, y, H, R, estimated)
    S = H @ P @ H.T + R
    K = np.where(estimated[:, None], P @ H.T @ np.linalg.inv(S), 0.0)
    joseph = (np.eye(SIZE) - K @ H) @ P @ (np.eye(SIZE) - K @ H).T + K @ R @ K.T
    assert np.array_equal(corrected[~estimated], state[~estimated])
    np.testing.assert_allclose(covariance, joseph, rtol=1e-6, atol=1e-7)


@given(SEEDS, st.integers(0, SIZE - 1))
def test_forget_makes_one_element_an_exact_zero(seed: int, i: int) -> None:
    state, P, *_ = problem(seed, 1)
    reset, covariance = forget(state, P, i)
    others = np.arange(SIZE) != i
    assert reset[i] == 0.0 and not covariance[i].any() and not covariance[:, i].any()
    assert np.array_equal(reset[others], state[others])
    assert np.array_equal(covariance[np.ix_(others, others)], P[np.ix_(others, others)])
