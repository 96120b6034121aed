"""Tests what the mapper learns about the noise of odometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.odometry_model import OdometryModel, rotated
from chefbot.slam.graph.params import GraphSlamParams
from chefbot.slam.motion_model import OdometryStep

PARAMS = GraphSlamParams()
CERTAIN, UNCERTAIN = np.ones(3), np.zeros(3)


def step_of(motion: SE2) -> OdometryStep:
    step = OdometryStep()
    step.add(motion)
    return step


STEP = step_of(SE2(0.4, 0.0, 0.1))
DEVIATION = np.sqrt(STEP.variance(PARAMS))


def off_by(error: np.ndarray) -> SE2:
    """Return the true motion of a step whose odometry is off by `error` (3,)."""
    return SE2.of(STEP.motion.array() - error)


def learned(factors: tuple[float, float], steps: int = 1500, seed: int = 1) -> OdometryModel:
    """Return the model after steps with errors of `factors` times the assumed deviations of place and heading."""
    rng, model = np.random.default_rng(seed), OdometryModel(PARAMS)
    for _ in range(steps):
        error = DEVIATION * rng.normal(size=3) * [factors[0], factors[0], factors[1]]
        model.observe(STEP, off_by(error), CERTAIN)
    return model


def test_at_first_the_noise_is_that_assumed() -> None:
    model = OdometryModel(PARAMS)
    assert model.scale == (1.0, 1.0)
    assert model.covariance(STEP) == pytest.approx(np.diag(STEP.variance(PARAMS)))


@pytest.mark.parametrize("factors", [(1.0, 1.0), (0.4, 1.5), (1.6, 0.5)])
def test_the_noise_becomes_that_of_the_errors(factors) -> None:
    model = learned(factors)
    assert model.scale == pytest.approx(factors, rel=0.15)
    expected = STEP.variance(PARAMS) * np.square([factors[0], factors[0], factors[1]])
    assert np.diag(model.covariance(STEP)) == pytest.approx(expected, rel=0.35)


@settings(max_examples=25)
@given(
    st.lists(st.tuples(*[st.floats(-10.0, 10.0)] * 3, *[st.floats(0.0, 1.0)] * 3), min_size=1, max_size=30)
)
def test_the_scale_of_the_noise_is_bounded(history) -> None:
    model = OdometryModel(PARAMS)
    for *error, a, b, c in history:
        model.observe(STEP, off_by(np.array(error)), np.array([a, b, c]))
        covariance = model.covariance(STEP) / STEP.variance(PARAMS)
        assert np.all((np.diag(covariance) >= 0.05 - 1e-9) & (np.diag(covariance) <= 4.0 + 1e-9))
        assert covariance[0, 0] == pytest.approx(covariance[1, 1])


def test_perfect_odometry_keeps_a_little_noise() -> None:
    assert learned((0.0, 0.0)).scale == pytest.approx((math.sqrt(0.05),) * 2)


def test_nothing_is_learned_from_an_uncertain_match() -> None:
    model = OdometryModel(PARAMS)
    for _ in range(50):
        model.observe(STEP, off_by(3.0 * DEVIATION), UNCERTAIN)
    assert model.scale == (1.0, 1.0)


def test_along_a_corridor_the_error_across_is_learned() -> None:
    across, along = OdometryModel(PARAMS), OdometryModel(PARAMS)
    for _ in range(1500):
        across.observe(STEP, off_by(DEVIATION * [50.0, 0.5, 0.0]), np.array([0.0, 1.0, 1.0]))
        along.observe(STEP, off_by(DEVIATION * [0.5, 50.0, 0.0]), np.array([1.0, 0.0, 1.0]))
    assert across.scale[0] == pytest.approx(0.5, rel=0.1)
    assert along.scale[0] == pytest.approx(0.5, rel=0.1)


def test_one_outlier_moves_the_scale_within_bounds() -> None:
    model = learned((1.0, 1.0))
    before = model.scale[0]
    model.observe(STEP, off_by(np.array([50.0, 50.0, 0.0])), CERTAIN)
    assert before < model.scale[0] < 1.05 * before


def test_a_turn_past_pi_is_not_an_error() -> None:
    step, model = step_of(SE2(0.0, 0.0, 3.1)), OdometryModel(PARAMS)
    step.add(SE2(0.0, 0.0, 0.1))
    for _ in range(100):
        model.observe(step, SE2(0.0, 0.0, 3.2), CERTAIN)
    assert model.scale[1] < 0.5


def test_other_parameters_keep_what_was_learned() -> None:
    model = learned((0.5, 0.5))
    learned_scale = model.scale
    noisier = GraphSlamParams(
        odometry_noise=OdometryNoise(
            translation_from_translation=0.3,
            translation_from_rotation=0.3,
            rotation_from_translation=0.3,
            rotation_from_rotation=0.3,
        )
    )
    model.retune(noisier)
    assert model.scale == learned_scale
    ratio = np.diag(model.covariance(STEP)) / STEP.variance(noisier)
    assert ratio == pytest.approx(np.square([learned_scale[0], learned_scale[0], learned_scale[1]]))


@settings(max_examples=30)
@given(st.floats(-10.0, 10.0), st.integers(0, 10_000))
def test_a_turned_covariance_is_that_of_turned_samples(yaw: float, seed: int) -> None:
    samples = np.random.default_rng(seed).normal(size=(50, 3)) @ np.diag([0.3, 0.1, 0.2])
    turned = np.array([[*(SE2(0.0, 0.0, yaw) @ SE2(x, y, 0.0))[:2], t] for x, y, t in samples])
    assert rotated(np.cov(samples.T), yaw) == pytest.approx(np.cov(turned.T), abs=1e-12)


def test_a_quarter_turn_swaps_the_axes() -> None:
    assert rotated(np.diag([1.0, 4.0, 9.0]), math.pi / 2) == pytest.approx(np.diag([4.0, 1.0, 9.0]))
    assert OdometryModel(PARAMS).covariance(step_of(IDENTITY)) == pytest.approx(np.eye(3) * 1e-4)
