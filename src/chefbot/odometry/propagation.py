"""Propagation between two wheel readings, split at the readings of the other sensors."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from chefbot.odometry.drive_model import FilterParameters
from chefbot.odometry.filter_state import MeanVelocity
from chefbot.odometry.kalman_update import CHI2_GATE, Flags, Indices, correct, distance, forget, whiten
from chefbot.odometry.motion_model import (
    DELTA_S,
    DELTA_YAW,
    GYRO_BIAS_X,
    GYRO_BIAS_Y,
    GYRO_BIAS_Z,
    INPUTS,
    SIZE,
    YAW,
    Array,
    predict,
)
from chefbot.odometry.sensor_health import (
    ACCELEROMETER,
    ATTITUDE,
    NEVER_NS,
    STUCK,
    Record,
    Records,
    note_rejection,
    note_use,
)
from chefbot.odometry.wheel_travel import WheelTravel

GYRO_TIMEOUT_NS = 100_000_000
"""Longest time before or after a gyro reading for which its rate is used, ns."""
SLOPE_TIME_CONSTANT = 1.0
"""Time constant of the floor slope under a driving robot without a gyro, s: a tile or two at walking
speed."""

SLIP_INFLATION = 25.0
"""Factor from the squared slip to the variance of a slipping wheel: large enough that the contradiction
passes the gate and hardly changes the calibration states that were estimated before."""
PART = np.dtype([("now_ns", np.int64), ("dt", np.float64), ("contradicted", np.bool_)])
"""Record of how far an interval has been propagated: the stamp reached; the duration, s, of the last part;
whether the gyro contradicted the wheels."""


class PropagationInterval(NamedTuple):
    """The propagation of a belief between two wheel readings, at constant wheel speeds.

    Readings of the other sensors are applied in between, at their stamps. The arrays belong to the interval
    and are changed in place.
    """

    state: Array
    covariance: Array
    prior_state: Array
    """State (n,) and covariance (n, n) before the last part."""
    prior_covariance: Array
    monitors: Records
    """Fault monitors (3,) of `IMU_SOURCES`."""
    memory: Records
    """Record (1,) of type `MEMORY` at the beginning, with the velocity of the interval before."""
    part: Records
    """Record (1,) of type `PART`."""
    body: FilterParameters
    rolled: WheelTravel
    """Travel of the wheels over the whole interval, with its covariance."""
    velocity: MeanVelocity
    """Mean velocity over the whole interval, with its duration."""
    standing: bool


@njit(cache=True, nogil=True)
def begin_interval(
    state: Array,
    covariance: Array,
    monitors: Records,
    memory: Records,
    body: FilterParameters,
    rolled: WheelTravel,
    begin_ns: int,
    end_ns: int,
    standing: bool,
) -> PropagationInterval:
    """Return the interval from begin_ns to end_ns > begin_ns, for copies of a belief's arrays."""
    # Mean velocities of the interval
    dt = (end_ns - begin_ns) / 1e9
    turn = (rolled.right - rolled.left) / body.separation
    velocity = MeanVelocity(0.5 * (rolled.left + rolled.right) / dt, turn / dt, dt)
    # Reset the increments; random walk of the gyro biases, Q = walk^2 dt
    reset, reset_covariance = forget(state, covariance, DELTA_S)
    reset, reset_covariance = forget(reset, reset_covariance, DELTA_YAW)
    for bias in (GYRO_BIAS_X, GYRO_BIAS_Y, GYRO_BIAS_Z):
        reset_covariance[bias, bias] += body.gyro_bias_walk**2 * dt
    part = np.zeros(1, PART)
    part[0]["now_ns"] = begin_ns
    return PropagationInterval(
        reset,
        reset_covariance,
        reset.copy(),
        reset_covariance.copy(),
        monitors.copy(),
        memory.copy(),
        part,
        body,
        rolled,
        velocity,
        standing,
    )


@njit(cache=True, nogil=True)
def end_interval(interval: PropagationInterval) -> None:
    """Keep the velocity of the interval, and since when wheels and gyro contradict each other."""
    memory, part = interval.memory[0], interval.part[0]
    memory["speed"], memory["turn"] = interval.velocity.speed, interval.velocity.turn
    memory["dt"] = interval.velocity.dt
    if not part["contradicted"]:
        memory["contradicted_ns"] = NEVER_NS
    elif memory["contradicted_ns"] == NEVER_NS:
        memory["contradicted_ns"] = part["now_ns"]


@njit(cache=True, nogil=True)
def speed_variance(interval: PropagationInterval) -> float:
    """Return the variance of the mean speed from the wheels, (m/s)^2."""
    rolled = interval.rolled
    summed = rolled.left_variance + rolled.right_variance + 2.0 * rolled.shared
    return 0.25 * summed / interval.velocity.dt**2


@njit(cache=True, nogil=True)
def move_to(interval: PropagationInterval, stamp_ns: int) -> None:
    """Propagate to this stamp by the wheels (EKF prediction)."""
    part, memory = interval.part[0], interval.memory[0]
    interval.prior_state[:], interval.prior_covariance[:] = interval.state, interval.covariance
    part["dt"] = 0.0
    if stamp_ns <= part["now_ns"]:
        return
    if memory["tilt_ns"] != NEVER_NS and stamp_ns - memory["tilt_ns"] > GYRO_TIMEOUT_NS:
        memory["tilt_ns"] = NEVER_NS
    part["dt"], part["now_ns"] = (stamp_ns - part["now_ns"]) / 1e9, stamp_ns
    _predict_part(interval, 0.0)
    _expect_changes(interval)


@njit(cache=True, nogil=True)
def slip(interval: PropagationInterval, error: float) -> None:
    """Repeat the last prediction with wheels whose yaw increment is wrong by `error`, rad.

    Either wheel may have slipped, so the travel is uncertain by half the slip to either side.
    """
    # Slip at the ground from the yaw error: error * l
    _predict_part(interval, error * interval.body.separation)


@njit(cache=True, nogil=True)
def _predict_part(interval: PropagationInterval, slipped: float) -> None:
    """Predict over the last part of the interval, with one wheel slipping by `slipped` metres."""
    seconds, memory = interval.part[0]["dt"], interval.memory[0]
    share, settling, gyro_seconds, rotation = seconds / interval.velocity.dt, 0.0, 0.0, np.zeros(2)
    noise = _wheel_noise(interval.rolled, share, slipped)
    # Roll and pitch from the gyro, or else from the slope model of the floor
    if memory["tilt_ns"] != NEVER_NS:
        gyro_seconds, rotation = seconds, memory["tilt_rates"] * seconds
        noise[2, 2] = memory["tilt_variances"][0] * seconds**2
        noise[3, 3] = memory["tilt_variances"][1] * seconds**2
    elif not interval.standing:
        settling = 1.0 - math.exp(-seconds / SLOPE_TIME_CONSTANT)
    # x' = f(x, u), P' = F P F^T + G Q G^T
    travel = np.array([interval.rolled.left, interval.rolled.right]) * share
    interval.state[:], interval.covariance[:] = predict(
        interval.prior_state,
        interval.prior_covariance,
        travel,
        rotation,
        gyro_seconds,
        noise,
        interval.body.separation,
        settling,
        interval.body.tilt,
    )


@njit(cache=True, nogil=True)
def _wheel_noise(rolled: WheelTravel, share: float, slipped: float) -> Array:
    """Return the wheels' part of the input covariance Q (6, 6) for this share of the interval."""
    noise = np.zeros((INPUTS, INPUTS))
    # Slip in the common mode (travel) and in the differential mode (yaw)
    travel, yaw = 0.25 * slipped**2, SLIP_INFLATION * slipped**2
    noise[0, 0] = rolled.left_variance * share + travel + yaw
    noise[1, 1] = rolled.right_variance * share + travel + yaw
    noise[0, 1] = noise[1, 0] = rolled.shared * share + travel - yaw
    # Slides to the left and up
    noise[4, 4] = noise[5, 5] = rolled.slide * share
    return noise


@njit(cache=True, nogil=True)
def _expect_changes(interval: PropagationInterval) -> None:
    """Add the wheel motion of the last part to the change expected from sensors whose readings repeat."""
    memory, velocity, seconds = interval.memory[0], interval.velocity, interval.part[0]["dt"]
    acceleration = (velocity.speed - memory["speed"]) / velocity.dt if memory["dt"] > 0.0 else 0.0
    if interval.monitors[ATTITUDE]["repeats"] > 0:
        interval.monitors[ATTITUDE]["expected_change"] += velocity.turn * seconds
    if interval.monitors[ACCELEROMETER]["repeats"] > 0:
        interval.monitors[ACCELEROMETER]["expected_change"] += acceleration * seconds


@njit(cache=True, nogil=True)
def selection_jacobian(states: Indices) -> Array:
    """Return the Jacobian H (m, n) of a reading that measures these states (m,) directly."""
    H = np.zeros((states.size, SIZE))
    for i in range(states.size):
        H[i, states[i]] = 1.0
    return H


@njit(cache=True, nogil=True)
def apply_update(
    interval: PropagationInterval, innovation: Array, H: Array, noise: Array, estimated: Flags
) -> None:
    """Apply a measurement update with `innovation` (m,), Jacobian H (m, n) and noise R (m, m).

    estimated (n,): mask of the elements of the state that may change.
    """
    interval.state[:], interval.covariance[:] = correct(
        interval.state, interval.covariance, innovation, H, noise, estimated
    )


@njit(cache=True, nogil=True)
def gated_update(
    interval: PropagationInterval,
    monitor: Record,
    innovation: Array,
    H: Array,
    noise: Array,
    inflated_states: Indices,
    estimated: Flags,
    max_outliers: int,
) -> None:
    """Apply a measurement update if the innovation passes the gate.

    inflated_states (m,): states whose covariance is inflated if the source stays outside the gate for
    `max_outliers` readings; H is lower triangular in them.
    """
    if monitor["fault"] == STUCK or not np.isfinite(innovation).all():
        note_rejection(monitor)
        return
    # Chi-square gate: y^T S^-1 y <= GATE
    distance_squared, S = distance(interval.covariance, innovation, H, noise)
    if distance_squared > CHI2_GATE:
        if monitor["refused_run"] < max_outliers:
            note_rejection(monitor)
            return
        # A persistent contradiction: inflate P until the innovation is on the gate
        _inflate_covariance(interval.covariance, H, S * (distance_squared / CHI2_GATE), inflated_states)
    # Measurement update
    apply_update(interval, innovation, H, noise, estimated)
    note_use(monitor)


@njit(cache=True, nogil=True)
def _inflate_covariance(covariance: Array, H: Array, added: Array, states: Indices) -> None:
    """Add J^-1 C J^-T to the covariance of the states (m,), with J their lower triangular columns of H.

    With C (m, m) added, the innovation lies at sqrt(GATE) standard deviations.
    """
    m = states.size
    jacobian = np.zeros((m, m))
    for i in range(m):
        for j in range(m):
            jacobian[i, j] = H[i, states[j]]
    # J^-1 C by forward substitution, and J^-1 (J^-1 C)^T
    inflation = whiten(jacobian, whiten(jacobian, added).T.copy())
    for i in range(m):
        for j in range(m):
            covariance[states[i], states[j]] += inflation[j, i]


@njit(cache=True, nogil=True)
def add_heading(interval: PropagationInterval, angle: float) -> None:
    """Add an angle, rad, that the wheels did not measure to the heading."""
    interval.state[YAW] += angle
    interval.state[DELTA_YAW] += angle


@njit(cache=True, nogil=True)
def inflate_heading(interval: PropagationInterval, variance: float) -> None:
    """Add a variance, rad^2, to the heading and to the yaw increment."""
    for i in (YAW, DELTA_YAW):
        for j in (YAW, DELTA_YAW):
            interval.covariance[i, j] += variance
