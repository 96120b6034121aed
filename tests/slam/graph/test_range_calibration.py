"""Tests the offset of all ranges: the elimination of the poses, and offsets of simulated lasers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.range_calibration import MAX_OFFSET, RangeCalibration, range_equation
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.scan_beams import beams_of

VIEWS = [SE2(1.6 + 0.6 * (k % 7), 1.2 + 0.1 * (k % 3), 0.35 * k) for k in range(12)]


@pytest.fixture
def seen(ring, angles):
    """Return a function: `seen(pose, error, applied)` gives a scan whose ranges are too long by `error` m, with
    `applied` m added to them already."""

    def scan(pose: SE2, error: float, applied: float = 0.0) -> ScanFeatures:
        ranges = ring.ranges(pose, angles, 20.0) + np.float32(error)
        return ScanFeatures.of(beams_of(angles, ranges, IDENTITY, 80.0, 3.0), 40.0, applied)

    return scan


def calibrated(seen, error: float, corrections=(0.0,), rounds: int = 1) -> float:
    """Return the offset found from views at known poses; corrections are applied to the scans in turn."""
    calibration = RangeCalibration()
    scans = [seen(pose, error, corrections[k % len(corrections)]) for k, pose in enumerate(VIEWS)]
    for k in range(rounds * len(VIEWS)):
        latest = [i % len(VIEWS) for i in range(max(k - 4, 0), k + 1)]
        calibration.observe([scans[i] for i in latest], np.array([VIEWS[i].array() for i in latest]))
    return calibration.offset


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.integers(1, 4))
def test_the_poses_are_eliminated_from_the_equation(seed: int, pairs: int) -> None:
    rng = np.random.default_rng(seed)
    h, g = np.zeros((pairs, 4, 4)), np.zeros((pairs, 4))
    for k in range(pairs):
        jacobian, residual = rng.normal(size=(20, 4)), rng.normal(size=20)
        h[k], g[k] = jacobian.T @ jacobian, jacobian.T @ residual

    # the precision of the offset alone is the inverse of its variance
    precision = np.array([1.0 / np.linalg.inv(one)[3, 3] for one in h])
    best = np.array([-np.linalg.solve(one, slope)[3] for one, slope in zip(h, g, strict=True)])
    stiffness, slope = range_equation(h, g)
    assert stiffness == pytest.approx(precision.sum(), rel=1e-3)
    assert slope == pytest.approx(-(precision * best).sum(), rel=1e-3, abs=1e-2)


@pytest.mark.parametrize("error", [-0.08, -0.03, 0.05, 0.1])
def test_ranges_that_are_too_long_are_shortened(seen, error: float) -> None:
    few, many = (calibrated(seen, error, rounds=rounds) for rounds in (1, 8))
    assert many == pytest.approx(-error, rel=0.2)
    assert abs(many + error) < abs(few + error) < abs(error), "few scans show less than many"


def test_true_ranges_are_left_as_they_are(seen) -> None:
    assert calibrated(seen, 0.0, rounds=4) == pytest.approx(0.0, abs=0.001)


@pytest.mark.parametrize("corrections", [(-0.05,), (-0.03,), (0.0, -0.06), (0.02, -0.01, -0.05)])
def test_the_whole_offset_is_found_in_corrected_scans(seen, corrections) -> None:
    assert calibrated(seen, 0.05, corrections) == pytest.approx(calibrated(seen, 0.05), abs=0.01)


def test_a_single_scan_shows_no_offset(seen) -> None:
    calibration = RangeCalibration()
    assert calibration.offset == 0.0
    calibration.observe([seen(VIEWS[0], 0.1)], VIEWS[0].array()[None])
    assert calibration.offset == 0.0


def test_scans_of_different_places_show_no_offset(seen) -> None:
    calibration = RangeCalibration()
    poses = np.array([[0.0, 0.0, 0.0], [500.0, 0.0, 0.0]])
    calibration.observe([seen(VIEWS[0], 0.1), seen(VIEWS[1], 0.1)], poses)
    assert calibration.offset == 0.0


@pytest.mark.parametrize("error", [-0.4, 0.4])
def test_no_more_than_a_believable_offset_is_found(seen, error: float) -> None:
    assert abs(calibrated(seen, error)) <= MAX_OFFSET


def test_after_enough_scans_the_offset_stays(seen) -> None:
    calibration = RangeCalibration()
    poses, true = np.array([VIEWS[0].array(), VIEWS[1].array()]), [seen(pose, 0.0) for pose in VIEWS[:2]]
    for _ in range(150):
        calibration.observe(true, poses)
    settled = calibration.offset
    for _ in range(20):
        calibration.observe([seen(pose, 0.1) for pose in VIEWS[:2]], poses)
    assert calibration.offset == settled
