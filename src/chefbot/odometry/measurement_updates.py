"""Measurement updates with gyro, accelerometer and attitude."""

from __future__ import annotations

import math

import numpy as np

from chefbot.maths.angles import wrap
from chefbot.odometry.gyro import MIN_GYRO_NOISE, update_gyro
from chefbot.odometry.kalman_update import CHI2_GATE, Flags
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
from chefbot.odometry.propagation import PropagationInterval, selection_jacobian
from chefbot.odometry.readings import ImuReading
from chefbot.odometry.sensor_health import Condition, Source
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


def update_imu(interval: PropagationInterval, reading: ImuReading) -> None:
    """Update the state with gyro, accelerometer and attitude at the stamp of the reading."""
    # Rates about x and y: zero-velocity update at standstill, otherwise input of the next prediction
    has_tilt = _has_tilt_rates(interval, reading) and not _zero_velocity_update(interval, reading)
    interval.tilt_reading = reading if has_tilt else None
    # Prediction to the stamp, then one measurement update per sensor
    interval.move_to(reading.stamp_ns)
    update_gyro(interval, reading)
    if math.isfinite(reading.force_variance[0]):
        _update_accelerometer(interval, reading)
    if any(math.isfinite(v) for v in reading.attitude_variance):
        _update_attitude(interval, reading)


def _has_tilt_rates(interval: PropagationInterval, reading: ImuReading) -> bool:
    measured = all(math.isfinite(v) for v in reading.rates_variance[:2])
    in_range = all(abs(rate) < interval.model.gyro_range for rate in reading.rates[:2])  # false for NaN
    return measured and in_range and interval.monitors[Source.GYRO].fault is Condition.FRESH


def _zero_velocity_update(interval: PropagationInterval, reading: ImuReading) -> bool:
    """Apply a zero-velocity update: the rates about x and y of a standing robot are the gyro's biases.

    Return False, without an update, if the robot moves or if the rates fail the gate because it is tilted.
    """
    if not interval.standing:
        return False
    axes = (GYRO_BIAS_X, GYRO_BIAS_Y)
    # z = (rate_x, rate_y), h(x) = (bias_x, bias_y)
    innovation = np.array(reading.rates[:2]) - interval.state[list(axes)]
    noise = np.diag([max(v, MIN_GYRO_NOISE**2) for v in reading.rates_variance[:2]])
    if interval.distance(innovation, selection_jacobian(axes), noise)[0] > CHI2_GATE:
        return False
    interval.correct(innovation, selection_jacobian(axes), noise, TILT_STATES)
    return True


def _update_accelerometer(interval: PropagationInterval, reading: ImuReading) -> None:
    """Update tilt and biases with the accelerometer's x and y axes."""
    value = np.array(reading.force[:2])
    monitor = interval.monitors[Source.ACCELEROMETER].with_reading(
        reading.stamp_ns, reading.force, STUCK_SPEED
    )
    interval.monitors[Source.ACCELEROMETER] = monitor
    if interval.last is None or interval.contradicted:
        return  # the wheels do not give the acceleration
    if max(abs(value)) >= FORCE_RANGE:  # false for NaN, which is refused below
        interval.monitors[Source.ACCELEROMETER] = monitor.with_rejected(Condition.SATURATED)
        return
    # h(x) with Jacobian H; R = sensor noise + vibration
    predicted, H, model_variance = _predicted_force(interval)
    noise = np.diag(np.array(reading.force_variance[:2]) + model_variance)
    interval.gated_update(Source.ACCELEROMETER, value - predicted, H, noise, (PITCH, ROLL), TILT_STATES)


def _predicted_force(interval: PropagationInterval) -> tuple[Array, Array, Array]:
    """Return the specific force h(x) (2,) along x and y, its Jacobian (2, n), and the model's variance (2,).

    The axle midpoint accelerates by (dv/dt, v w), a sensor at (x, y) from it by -w^2 (x, y) in addition, and
    by dw/dt times its distance, of which only the magnitude is known. Both measure gravity along the tilted
    axes.
    """
    # dv/dt and dw/dt between the mean velocities of two intervals
    state, pace, last, body = (
        interval.state,
        interval.velocity,
        interval.last or interval.velocity,
        interval.model,
    )
    between = 0.5 * (pace.dt + last.dt)
    acceleration, yaw_acceleration = (pace.speed - last.speed) / between, (pace.turn - last.turn) / between
    sr, cr, sp, cp = (f(state[i]) for i in (ROLL, PITCH) for f in (math.sin, math.cos))
    # Linear, centripetal and Euler acceleration, gravity and accelerometer bias
    force_x = (
        acceleration
        - pace.turn**2 * body.imu_x
        - yaw_acceleration * body.imu_y
        - GRAVITY * sp
        + state[ACCEL_BIAS_X]
    )
    force_y = pace.turn * (pace.speed - pace.turn * body.imu_y) + yaw_acceleration * body.imu_x
    force_y += GRAVITY * cp * sr + state[ACCEL_BIAS_Y]
    # Jacobian by biases, pitch and roll
    H = selection_jacobian((ACCEL_BIAS_X, ACCEL_BIAS_Y))
    H[0, PITCH], H[1, ROLL], H[1, PITCH] = -GRAVITY * cp, GRAVITY * cp * cr, -GRAVITY * sp * sr
    # Variance of vibration, angular acceleration and of the wheels' acceleration
    model_variance = np.zeros(2)
    if not interval.standing:
        model_variance += VIBRATION**2 + (yaw_acceleration * math.hypot(body.imu_x, body.imu_y)) ** 2
        model_variance[0] += 2.0 * interval.speed_variance / between**2
    return np.array([force_x, force_y]), H, model_variance


def _update_attitude(interval: PropagationInterval, reading: ImuReading) -> None:
    """Update roll, pitch and yaw with the axes of the attitude that are measured."""
    before = interval.monitors[Source.ATTITUDE]
    interval.monitors[Source.ATTITUDE] = before.with_reading(reading.stamp_ns, reading.attitude, STUCK_TURN)
    # Innovation of the measured axes, wrapped
    measured = [i for i in range(3) if math.isfinite(reading.attitude_variance[i])]
    innovation = np.array([wrap(reading.attitude[i] - interval.state[ROLL + i]) for i in measured])
    axes = tuple(ROLL + i for i in measured)
    noise = np.diag([reading.attitude_variance[i] for i in measured])
    interval.gated_update(Source.ATTITUDE, innovation, selection_jacobian(axes), noise, axes)
