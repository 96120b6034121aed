"""Measurement updates with gyro, accelerometer and attitude."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chefbot.maths.angles import wrap
from chefbot.odometry.gyro import MIN_GYRO_NOISE, update_gyro
from chefbot.odometry.kalman_update import ALL, CHI2_GATE, Flags, distance
from chefbot.odometry.motion_model import (
    ACCEL_BIAS_X,
    ACCEL_BIAS_Y,
    GYRO_BIAS_X,
    GYRO_BIAS_Y,
    PITCH,
    ROLL,
    SIZE,
    Array,
    Z,
)
from chefbot.odometry.propagation import (
    PropagationInterval,
    apply_update,
    gated_update,
    move_to,
    selection_jacobian,
    speed_variance,
)
from chefbot.odometry.sensor_health import (
    ACCELEROMETER,
    ATTITUDE,
    GYRO,
    NEVER_NS,
    NO_FAULT,
    SATURATED,
    Record,
    note_fault,
    note_reading,
)
from chefbot.robot.spec import GRAVITY

VIBRATION = 0.5
"""Standard deviation of the vibration that the accelerometer of a rolling robot measures, m/s^2. The two
recordings that robot_localization is tested with have 0.7 (a Husky on asphalt) and 0.9 (a Jackal in a
simulator), including the robot's own accelerations."""
FORCE_RANGE = 2.0 * GRAVITY
"""Narrowest range of the accelerometers in use, m/s^2 (MPU-6050 register map, AFS_SEL 0)."""
TILT_STATES: Flags = np.zeros(SIZE, np.bool_)
"""States that the accelerometer and the gyro about x and y may change. Their measurement models take the
wheel motion as given, so the planar states (heading, wheels, gyro about z) are consider states in these
updates."""
TILT_STATES[[Z, ROLL, PITCH, GYRO_BIAS_X, GYRO_BIAS_Y, ACCEL_BIAS_X, ACCEL_BIAS_Y]] = True
STUCK_TURN, STUCK_SPEED = 0.05, 0.1
"""Wheel motion (rad, m/s) from which repeating readings of attitude and accelerometer are stuck."""
MAX_ATTITUDE_OUTLIERS, MAX_ACCELEROMETER_OUTLIERS = 5, 50
"""Outliers in a row after which a source is accepted, because then the estimate is wrong. The accelerometer
observes the attitude only indirectly, and a push lasts longer than an outlier."""

_wrap = njit(cache=True, nogil=True)(wrap)


@njit(cache=True, nogil=True)
def update_imu(interval: PropagationInterval, reading: Record) -> None:
    """Update the state with gyro, accelerometer and attitude at the stamp of the reading, of type `IMU`."""
    # Rates about x and y: zero-velocity update at standstill, otherwise input of the next prediction
    memory = interval.memory[0]
    memory["tilt_ns"] = NEVER_NS
    if _has_tilt_rates(interval, reading) and not _zero_velocity_update(interval, reading):
        memory["tilt_ns"] = reading["stamp_ns"]
        memory["tilt_rates"][:] = reading["rates"][:2]
        memory["tilt_variances"][:] = reading["rates_variance"][:2]
    # Prediction to the stamp, then one measurement update per sensor
    move_to(interval, reading["stamp_ns"])
    update_gyro(interval, reading)
    if math.isfinite(reading["force_variance"][0]):
        _update_accelerometer(interval, reading)
    if np.isfinite(reading["attitude_variance"]).any():
        _update_attitude(interval, reading)


@njit(cache=True, nogil=True)
def _has_tilt_rates(interval: PropagationInterval, reading: Record) -> bool:
    measured = np.isfinite(reading["rates_variance"][:2]).all()
    in_range = (np.abs(reading["rates"][:2]) < interval.body.gyro_range).all()  # false for NaN
    return measured and in_range and interval.monitors[GYRO]["fault"] == NO_FAULT


@njit(cache=True, nogil=True)
def _zero_velocity_update(interval: PropagationInterval, reading: Record) -> bool:
    """Apply a zero-velocity update: the rates about x and y of a standing robot are the gyro's biases.

    Return False, without an update, if the robot moves or if the rates fail the gate because it is tilted.
    """
    if not interval.standing:
        return False
    # z = (rate_x, rate_y), h(x) = (bias_x, bias_y)
    H = selection_jacobian(np.array([GYRO_BIAS_X, GYRO_BIAS_Y]))
    innovation = reading["rates"][:2] - interval.state[GYRO_BIAS_X : GYRO_BIAS_Y + 1]
    noise = np.diag(np.maximum(reading["rates_variance"][:2], MIN_GYRO_NOISE**2))
    if distance(interval.covariance, innovation, H, noise)[0] > CHI2_GATE:
        return False
    apply_update(interval, innovation, H, noise, TILT_STATES)
    return True


@njit(cache=True, nogil=True)
def _update_accelerometer(interval: PropagationInterval, reading: Record) -> None:
    """Update tilt and biases with the accelerometer's x and y axes."""
    value, monitor = reading["force"][:2], interval.monitors[ACCELEROMETER]
    note_reading(monitor, reading["stamp_ns"], reading["force"], STUCK_SPEED)
    if interval.memory[0]["dt"] == 0.0 or interval.part[0]["contradicted"]:
        return  # the wheels do not give the acceleration
    if max(abs(value[0]), abs(value[1])) >= FORCE_RANGE:  # false for NaN, which is refused below
        note_fault(monitor, SATURATED)
        return
    # h(x) with Jacobian H; R = sensor noise + vibration
    predicted, H, model_variance = _predicted_force(interval)
    noise = np.diag(reading["force_variance"][:2] + model_variance)
    axes = np.array([PITCH, ROLL])
    gated_update(
        interval, monitor, value - predicted, H, noise, axes, TILT_STATES, MAX_ACCELEROMETER_OUTLIERS
    )


@njit(cache=True, nogil=True)
def _predicted_force(interval: PropagationInterval) -> tuple[Array, Array, Array]:
    """Return the specific force h(x) (2,) along x and y, its Jacobian (2, n), and the model's variance (2,).

    The axle midpoint accelerates by (dv/dt, v w), a sensor at (x, y) from it by -w^2 (x, y) in addition, and
    by dw/dt times its distance, of which only the magnitude is known. Both measure gravity along the tilted
    axes.
    """
    # dv/dt and dw/dt between the mean velocities of two intervals
    state, pace, last, body = interval.state, interval.velocity, interval.memory[0], interval.body
    between = 0.5 * (pace.dt + last["dt"])
    acceleration = (pace.speed - last["speed"]) / between
    yaw_acceleration = (pace.turn - last["turn"]) / between
    sr, cr = math.sin(state[ROLL]), math.cos(state[ROLL])
    sp, cp = math.sin(state[PITCH]), math.cos(state[PITCH])
    # Linear, centripetal and Euler acceleration, gravity and accelerometer bias
    force_x = acceleration - pace.turn**2 * body.imu_x - yaw_acceleration * body.imu_y
    force_x += -GRAVITY * sp + state[ACCEL_BIAS_X]
    force_y = pace.turn * (pace.speed - pace.turn * body.imu_y) + yaw_acceleration * body.imu_x
    force_y += GRAVITY * cp * sr + state[ACCEL_BIAS_Y]
    # Jacobian by biases, pitch and roll
    H = selection_jacobian(np.array([ACCEL_BIAS_X, ACCEL_BIAS_Y]))
    H[0, PITCH], H[1, ROLL], H[1, PITCH] = -GRAVITY * cp, GRAVITY * cp * cr, -GRAVITY * sp * sr
    # Variance of vibration, angular acceleration and of the wheels' acceleration
    model_variance = np.zeros(2)
    if not interval.standing:
        model_variance += VIBRATION**2 + (yaw_acceleration * body.imu_distance) ** 2
        model_variance[0] += 2.0 * speed_variance(interval) / between**2
    return np.array([force_x, force_y]), H, model_variance


@njit(cache=True, nogil=True)
def _update_attitude(interval: PropagationInterval, reading: Record) -> None:
    """Update roll, pitch and yaw with the axes of the attitude that are measured."""
    monitor, attitude = interval.monitors[ATTITUDE], reading["attitude"]
    note_reading(monitor, reading["stamp_ns"], attitude, STUCK_TURN)
    # Innovation of the measured axes, wrapped
    measured = np.flatnonzero(np.isfinite(reading["attitude_variance"]))
    innovation, noise = np.zeros(measured.size), np.zeros((measured.size, measured.size))
    for i in range(measured.size):
        axis = measured[i]
        innovation[i] = _wrap(attitude[axis] - interval.state[ROLL + axis])
        noise[i, i] = reading["attitude_variance"][axis]
    axes = ROLL + measured
    H = selection_jacobian(axes)
    gated_update(interval, monitor, innovation, H, noise, axes, ALL, MAX_ATTITUDE_OUTLIERS)
