"""Tests the compiled filter over an interval against plain formulas in NumPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy_filter import filtered
from sensor_readings import BODY

from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.fusion import propagate
from chefbot.odometry.motion_model import DELTA_YAW_GYRO, SIZE, Array
from chefbot.odometry.propagation import _inflate_covariance
from chefbot.odometry.readings import IMU, ImuReading
from chefbot.odometry.sensor_health import ACCELEROMETER, ATTITUDE, GYRO, NEVER_NS, Records
from chefbot.odometry.wheel_travel import WheelTravel

STEP_NS, GYRO_NS = 20_000_000, -5_000_000
TILT = np.array([0.01, -0.02]), np.array([1e-4, 2e-4])
"""Rates about x and y at the beginning of an interval, rad/s, and their variances."""
SEEDS = st.integers(0, 2**32 - 1)


def belief_before(rng: np.random.Generator, last: tuple[float, float, float]) -> FilterState:
    """Return a correlated belief that is not level, with speed, yaw rate and duration of the interval before."""
    root = 0.3 * rng.normal(size=(SIZE, SIZE)) * np.sqrt(np.diag(BODY.start()[1]) + 1e-6)[:, None]
    belief = FilterState.initial(BODY)._replace(state=0.01 * rng.normal(size=SIZE), covariance=root @ root.T)
    belief.state[DELTA_YAW_GYRO] *= 0.01  # within the gate
    memory = dict(zip(("speed", "turn", "dt"), last, strict=True))
    memory |= {"gyro_ns": GYRO_NS, "tilt_ns": 0, "tilt_rates": TILT[0], "tilt_variances": TILT[1]}
    for name, value in memory.items():
        belief.memory[name] = value
    return belief


def imu(stamp_ns: int, rng: np.random.Generator) -> ImuReading:
    """Return a reading within the gates."""
    rates, force, attitude = (tuple((0.01 * rng.normal(size=3)).tolist()) for _ in range(3))
    variances = (4e-4, 5e-4, 0.09), (0.3, 0.4, 0.5), (0.04, 0.05, 0.06)
    return ImuReading(stamp_ns, rates, variances[0], force, variances[1], attitude, variances[2])


def used(monitors: Records) -> list[bool]:
    """Return whether readings of gyro, accelerometer and attitude were used."""
    return [bool(monitors["used_ns"][k] > 0) for k in (GYRO, ACCELEROMETER, ATTITUDE)]


@settings(max_examples=50)
@given(SEEDS, st.booleans(), st.sampled_from([(), (9,), (20,), (3, 11), (8, 20)]))
def test_an_interval_equals_the_plain_formulas(seed: int, standing: bool, stamps: tuple[int, ...]) -> None:
    rng, last = np.random.default_rng(seed), (0.0 if standing else 0.28, 0.0, 0.021)
    belief = belief_before(rng, last)
    left, right = (0.0, 1e-9) if standing else rng.uniform(0.0053, 0.0059, size=2).tolist()
    rolled, readings = (
        WheelTravel(left, right, 2e-6, 3e-6, 1e-6, 1e-7),
        [imu(ms * 10**6, rng) for ms in stamps],
    )
    if standing:
        belief.memory["tilt_ns"] = NEVER_NS
    before = belief.state, belief.covariance, belief.monitor_records, belief.memory
    after = propagate(*before, BODY.parameters, rolled, 0, STEP_NS, standing, np.array(readings, IMU))
    timed = [(reading.stamp_ns / 1e9, reading) for reading in readings]
    plain = filtered(before[:2], BODY, rolled, 0.02, last, GYRO_NS / 1e9, standing, TILT, timed)
    np.testing.assert_allclose(after[0], plain[0], rtol=1e-8, atol=1e-11)
    np.testing.assert_allclose(after[1], plain[1], rtol=1e-7, atol=1e-12)
    assert used(after[2]) == [bool(stamps)] * 3


@given(SEEDS, st.integers(1, 3))
def test_inflation_equals_the_plain_formula(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    H, states = np.zeros((m, SIZE)), rng.permutation(SIZE)[:m]
    J: Array = np.tril(rng.normal(size=(m, m)), -1) + np.diag(rng.uniform(0.5, 2.0, size=m))
    H[:, states] = J
    P, root = np.eye(SIZE), rng.normal(size=(m, m))
    C, inverse, inflated = root @ root.T, np.linalg.inv(J), np.eye(SIZE)
    _inflate_covariance(inflated, H, C, states)
    P[np.ix_(states, states)] += inverse @ C @ inverse.T
    np.testing.assert_allclose(inflated, P, rtol=1e-9, atol=1e-9)
