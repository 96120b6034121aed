"""Tests motion model, resampling, tempering, clusters, roughening and recovery estimator against their theory."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.localization import clusters, odometry_motion, recovery, resampling, roughening, tempering
from chefbot.localization.likelihood_field import surfaces
from chefbot.localization.params import AmclParams
from chefbot.localization.pose_bins import PoseBins
from chefbot.maths.grid import Grid
from chefbot.maths.resampling import low_variance
from chefbot.maths.se2 import SE2

GRID = Grid(np.zeros((200, 200), np.int8), 0.05, 0.0, 0.0)
angles = st.floats(-3.0, 3.0)
lengths = st.floats(-2.0, 2.0)


@given(lengths, lengths, angles)
def test_the_three_odometry_motions_compose_the_motion(x: float, y: float, yaw: float) -> None:
    turn, travel, second = odometry_motion.decompose(SE2(x, y, yaw))
    again = SE2(0, 0, turn) @ SE2(travel, 0, 0) @ SE2(0, 0, second)
    assert again.distance(SE2(x, y, 0)) < odometry_motion.MIN_TRANSLATION + 1e-9
    assert abs(math.remainder(again.yaw - yaw, 2 * math.pi)) < 1e-9
    assert abs(turn) <= math.pi / 2 + 1e-9


@settings(max_examples=20)
@given(lengths, st.floats(-0.3, 0.3), angles, angles)
def test_particles_have_the_mean_and_spread_of_the_motion_model(
    x: float, y: float, yaw: float, start: float
) -> None:
    motion = SE2(x, y, yaw)
    particles = np.tile(np.array([3.0, -2.0, start]), (20_000, 1))
    odometry_motion.move(particles, motion, AmclParams(), np.random.default_rng(3))
    expected = SE2(3.0, -2.0, start) @ motion
    first, length, second = odometry_motion.spread(motion, AmclParams())
    side = math.hypot(length, first * math.hypot(x, y))
    assert np.abs(particles[:, :2].mean(axis=0) - (expected.x, expected.y)).max() < (
        odometry_motion.MIN_TRANSLATION + 0.05 * side + first**2 * math.hypot(x, y)
    )
    off = np.remainder(particles[:, 2] - expected.yaw + math.pi, 2 * math.pi) - math.pi
    assert off.mean() == pytest.approx(0.0, abs=0.04 * math.hypot(first, second) + 1e-9)
    assert off.std() == pytest.approx(math.hypot(first, second), rel=0.05, abs=1e-9)
    assert np.all(np.abs(particles[:, 2]) <= math.pi)


def test_a_standing_robot_moves_no_particle() -> None:
    particles = np.array([[1.0, 2.0, 3.0]])
    odometry_motion.move(particles, SE2(0, 0, 0), AmclParams(), np.random.default_rng(0))
    np.testing.assert_allclose(particles, [[1.0, 2.0, 3.0]], atol=1e-12)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40), st.integers(1, 300), st.floats(0, 0.999999))
def test_low_variance_resampling_is_within_one_of_each_share(raw: list[float], n: int, offset: float) -> None:
    weights = np.array(raw) + 1e-9
    weights /= weights.sum()
    counts = np.bincount(low_variance(weights, n, offset), minlength=weights.size)
    assert counts.sum() == n
    assert np.all(np.abs(counts - n * weights) < 1.0 + 1e-6)


def test_kld_bound_is_the_approximated_chi_square_quantile() -> None:
    from scipy.stats import chi2, norm

    for bins in (5, 50, 500):
        exact = chi2.ppf(norm.cdf(2.33), bins - 1) / (2 * 0.05)
        assert resampling.kld_bound(bins, 0.05, 2.33) == pytest.approx(exact, rel=0.01)


def test_a_wider_distribution_keeps_more_particles_within_limits() -> None:
    rng = np.random.default_rng(0)
    params = AmclParams(min_particles=100, max_particles=8000)
    bins = PoseBins(GRID)
    counts = []
    for spread in (0.01, 0.3, 1.0, 3.0):
        particles = np.array([5.0, 5.0, 0.0]) + rng.normal(size=(10_000, 3)) * (spread, spread, spread)
        out = resampling.resample(particles, np.full(10_000, 1e-4), bins, params, rng, 100, 8000)
        counts.append(len(out))
        assert np.all(bins.labels == -1)
    assert counts == sorted(counts) and counts[0] < 700 and counts[-1] == 8000


@settings(max_examples=30)
@given(st.integers(0, 1000), st.floats(0.05, 0.9), st.floats(0.1, 200.0))
def test_tempering_keeps_exactly_the_requested_share(seed: int, share: float, sharpness: float) -> None:
    rng = np.random.default_rng(seed)
    scores = -sharpness * rng.random(1500)
    even = np.full(1500, 1 / 1500)
    exponent = tempering.exponent_for(scores, even, 1.0, share)
    weights = tempering.weights_of(scores, even, exponent)
    effective = 1.0 / np.sum(weights**2) / 1500
    assert weights.sum() == pytest.approx(1.0)
    assert effective >= share * 0.999
    assert exponent == 1.0 or effective < share + 0.05


def test_narrow_scans_count_as_few_independent_beams() -> None:
    wide = tempering.independent_beams(np.linspace(-math.pi, math.pi, 360), 0.1)
    narrow = tempering.independent_beams(np.linspace(-0.5, 0.5, 360), 0.1)
    assert 60 <= wide <= 64 and 10 <= narrow <= 12
    assert tempering.independent_beams(np.zeros(7), 0.0) == 7


def test_the_heaviest_cluster_is_the_estimate_not_the_mean() -> None:
    rng = np.random.default_rng(0)
    first = np.array([2.0, 2.0, math.pi]) + rng.normal(size=(700, 3)) * 0.05
    second = np.array([8.0, 8.0, 0.0]) + rng.normal(size=(300, 3)) * 0.05
    both = np.concatenate([first, second])
    both[:, 2] = np.remainder(both[:, 2] + math.pi, 2 * math.pi) - math.pi
    bins = PoseBins(GRID)
    cluster = clusters.heaviest(both, np.full(1000, 1e-3), bins)
    assert cluster.mean.distance(SE2(2.0, 2.0, 0)) < 0.01
    assert abs(math.remainder(cluster.mean.yaw - math.pi, 2 * math.pi)) < 0.01
    assert cluster.weight == pytest.approx(0.7)
    np.testing.assert_allclose(np.sqrt(np.diag(cluster.covariance)), 0.05, rtol=0.1)
    assert np.all(bins.labels == -1)
    reversed_weights = np.concatenate([np.full(700, 0.1 / 700), np.full(300, 0.9 / 300)])
    assert clusters.heaviest(both, reversed_weights, bins).mean.distance(SE2(8.0, 8.0, 0)) < 0.01


def test_roughening_separates_copies_and_keeps_the_spread() -> None:
    rng = np.random.default_rng(0)
    distinct = np.array([5.2, 5.2, 0.08]) + rng.normal(size=(60, 3)) * 0.02
    copies = np.repeat(distinct, 20, axis=0)
    before = copies.std(axis=0)
    roughening.roughen(copies, 60 / 1200, PoseBins(GRID), rng)
    assert len(np.unique(copies[:, 0])) == 1200
    np.testing.assert_allclose(copies.std(axis=0), before, rtol=0.15)


def test_recovery_probability_rises_with_a_bad_fit_and_resets() -> None:
    estimator = recovery.RecoveryEstimator(0.02, 0.3)
    assert estimator.random_particle_probability == 0.0
    for _ in range(50):
        estimator.update(0.8)
    assert estimator.random_particle_probability == 0.0
    for _ in range(8):
        estimator.update(0.3)
    assert 0.3 < estimator.random_particle_probability < 1.0
    for _ in range(20):
        estimator.update(0.8)
    assert estimator.random_particle_probability == 0.0
    never = recovery.RecoveryEstimator(0.0, 0.0)
    never.update(0.8)
    never.update(0.1)
    assert never.random_particle_probability == 0.0


def test_cells_deep_within_a_solid_are_not_surface() -> None:
    """Maps of games and floor plans are often occupied everywhere outside the rooms."""
    solid = np.ones((40, 50), bool)
    solid[10:30, 10:40] = False
    assert not surfaces(solid)[:8].any() and not surfaces(solid)[:, :8].any()
    assert surfaces(solid)[8:10, 10:40].all()
    walls = np.random.default_rng(1).random((40, 50)) < 0.2
    thick = np.zeros_like(walls)
    thick[5:9] = True
    assert (surfaces(thick) == thick).all(), "all cells of a wall of four cells are surface"
    assert (surfaces(walls) == walls).all()
