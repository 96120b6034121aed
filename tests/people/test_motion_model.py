"""Properties of the Kalman filter of a person."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.people.motion_model import MotionState, measurement_update, propagate

coordinates = st.floats(-50.0, 50.0)
variances = st.floats(1e-6, 10.0)
START = MotionState(1.0, 2.0, 0.5, -0.5, 0.01, 0.0, 0.5)
steps = st.lists(
    st.one_of(
        st.tuples(st.just("propagate"), st.floats(0.0, 5.0), st.sampled_from([math.inf, 0.5, 2.0])),
        st.tuples(st.just("update"), coordinates, variances),
    ),
    max_size=40,
)


@given(steps)
def test_covariances_stay_symmetric_and_positive_definite(history: list[tuple[str, float, float]]) -> None:
    state = START
    for kind, value, other in history:
        if kind == "propagate":
            state = propagate(state, value, 0.64, other)
        else:
            state = measurement_update(state, value, -value, other)
        covariance = state.covariance()
        assert np.array_equal(covariance, covariance.T)
        assert np.linalg.eigvalsh(covariance).min() > 0.0


@given(st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_doubt_grows_with_the_horizon(first: float, more: float) -> None:
    near, far = propagate(START, first, 0.64), propagate(START, first + more, 0.64)
    assert far.variance >= near.variance
    assert far.speed_variance >= near.speed_variance
    assert (far.x, far.y) == pytest.approx((1.0 + 0.5 * (first + more), 2.0 - 0.5 * (first + more)))


@given(st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_two_predictions_are_one_over_both_times(a: float, b: float) -> None:
    for decay in (math.inf, 1.5):
        density = 0.64 if math.isinf(decay) else 0.0
        two, one = (
            propagate(propagate(START, a, density, decay), b, density, decay),
            propagate(START, a + b, density, decay),
        )
        assert two == pytest.approx(one, rel=1e-9, abs=1e-9)


def squared_distance(state: MotionState, x: float, y: float, variance: float) -> float:
    """Squared Mahalanobis distance of a measured point."""
    return ((x - state.x) ** 2 + (y - state.y) ** 2) / (state.variance + variance)


@given(coordinates, coordinates, variances)
def test_a_measurement_never_adds_variance(x: float, y: float, variance: float) -> None:
    after = measurement_update(START, x, y, variance)
    assert after.variance <= START.variance
    assert after.speed_variance <= START.speed_variance
    assert (
        squared_distance(after, x, y, variance)
        <= squared_distance(START, x, y, variance) * (1.0 + 1e-9) + 1e-12
    )


def test_it_is_the_textbook_filter() -> None:
    dt, q, r = 0.2, 0.64, 0.05
    f = np.kron([[1.0, dt], [0.0, 1.0]], np.eye(2))
    noise = np.kron(q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]), np.eye(2))
    h = np.eye(2, 4)
    mean, p = f @ np.array(START[:4]), f @ START.covariance() @ f.T + noise
    gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + r * np.eye(2))
    mean, p = mean + gain @ (np.array([1.4, 1.7]) - h @ mean), (np.eye(4) - gain @ h) @ p
    state = measurement_update(propagate(START, dt, q), 1.4, 1.7, r)
    assert np.array(state[:4]) == pytest.approx(mean)
    assert state.covariance() == pytest.approx(p)


def test_the_velocity_of_the_unseen_decays() -> None:
    later = propagate(START, 3.0, 0.64, decay=1.5)
    assert later.speed == pytest.approx(START.speed * math.exp(-2.0))
    assert later.x < START.x + 1.5 * START.vx
