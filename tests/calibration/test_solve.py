"""Wheels, mount and gyro come back from the drives of a robot whose numbers are known."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.calibration.errors import CalibrationError
from chefbot.calibration.gyro import solve_gyro
from chefbot.calibration.solve import solve
from chefbot.calibration.umbmark import return_errors, umbmark

sys.path.insert(0, str(Path(__file__).parent))
from drives import DRAWN, SENSOR, Built, Track, usual

BUILT = st.builds(
    Built,
    left=st.floats(0.96, 1.04),
    right=st.floats(0.96, 1.04),
    separation=st.floats(0.95, 1.05),
    yaw=st.floats(-0.1, 0.1),
    gyro_scale=st.floats(0.9, 1.1),
    gyro_offset=st.floats(-0.02, 0.02),
)
NEAR = st.builds(
    Built, st.floats(0.99, 1.01), st.floats(0.99, 1.01), st.floats(0.97, 1.03), *[st.just(0.0)] * 3
)


@given(BUILT)
@settings(max_examples=15, deadline=None)
@pytest.mark.slow
def test_solver_recovers_the_wheel_and_sensor_parameters(built: Built) -> None:
    track, _ = usual(built)
    found = solve(track.legs, track.links(), track.poses, DRAWN, SENSOR)
    assert found.wheels.factors(DRAWN) == pytest.approx((built.left, built.right, built.separation), abs=1e-4)
    assert found.sensor.yaw == pytest.approx(built.yaw, abs=2e-4)
    assert not found.slipped.any()
    errors = np.array(found.wheels.factors(DRAWN)) - (built.left, built.right, built.separation)
    assert (np.abs(errors) < 4.0 * found.deviations[:3]).all()


@given(NEAR)
@settings(max_examples=15, deadline=None)
def test_umbmark_recovers_both_ratios_and_closes_the_squares(built: Built) -> None:
    _, squares = usual(built)
    ratios, better = umbmark(squares, DRAWN, built.sensor)
    assert ratios.wheel_ratio == pytest.approx(built.right / built.left, abs=2e-4)
    mean = (built.left + built.right) / 2.0
    assert ratios.separation_ratio == pytest.approx(built.separation / mean, abs=1e-3)
    before = return_errors(squares, DRAWN, built.sensor).worst
    after = return_errors(squares, better, built.sensor).worst
    scale = 2.0 * abs(mean - 1.0)  # what the mean diameter, which it cannot see, leaves
    assert after <= max(0.1 * before, scale, 0.003)


@given(BUILT)
@settings(max_examples=15, deadline=None)
def test_solver_recovers_the_gyro_scale(built: Built) -> None:
    track, _ = usual(built)
    found = solve_gyro(track.legs)
    assert found.scale == pytest.approx(built.gyro_scale, abs=1e-6)
    assert found.offset == pytest.approx(built.gyro_offset, abs=1e-6)


def test_legs_with_wheel_slip_are_excluded_and_reported() -> None:
    built = Built(left=1.01, right=0.995, separation=1.02)
    track, _ = usual(built, squares=2)
    bad = []
    for slip in (0.03, 0.05, -0.04):
        track.go(1.5, 0.0, slip)
        bad.append(len(track.legs) - 1)
        track.go(-1.5, 0.0)
    found = solve(track.legs, track.links(), track.poses, DRAWN, SENSOR)
    assert np.flatnonzero(found.slipped).tolist() == bad
    assert found.wheels.factors(DRAWN) == pytest.approx((1.01, 0.995, 1.02), abs=3e-4)


def test_a_robot_that_always_slips_is_refused() -> None:
    track, rng = Track(Built()), np.random.default_rng(1)
    for _ in range(24):
        track.go(1.0, 0.0, slip=float(rng.normal(0.0, 0.2)))
        track.go(0.0, math.pi / 2)
    with pytest.raises(CalibrationError, match=r"fit no wheels.*they slip"):
        solve(track.legs, track.links(), track.poses, DRAWN, SENSOR)


def test_too_few_drives_and_a_dead_gyro_are_refused() -> None:
    track, _ = usual(Built())
    with pytest.raises(CalibrationError, match="too few"):
        solve(track.legs[:4], track.links(), track.poses, DRAWN, SENSOR)
    dead, _ = usual(Built(gyro_scale=0.0))
    with pytest.raises(CalibrationError, match="dead"):
        solve_gyro(dead.legs)
    with pytest.raises(CalibrationError, match="UMBmark needs a square to the left"):
        umbmark([Track(Built()).square(2.0, -1)], DRAWN, SENSOR)
