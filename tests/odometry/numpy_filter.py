"""The filter over one interval between wheel readings as plain formulas in NumPy, for readings without faults.

Jacobians are derivatives along the imaginary axis (Squire & Trapp 1998, "Using complex variables to estimate
derivatives of real functions"), which are exact to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.kalman_update import ALL
from chefbot.odometry.measurement_updates import TILT_STATES, VIBRATION
from chefbot.odometry.motion_model import (
    ACCEL_BIAS_X,
    ACCEL_BIAS_Y,
    DELTA_S,
    DELTA_YAW,
    DELTA_YAW_GYRO,
    GYRO_BIAS_X,
    GYRO_BIAS_Y,
    GYRO_BIAS_Z,
    GYRO_SCALE,
    LEFT,
    PITCH,
    RIGHT,
    ROLL,
    SEPARATION,
    SIZE,
    YAW,
)
from chefbot.odometry.readings import ImuReading
from chefbot.odometry.wheel_travel import WheelTravel
from chefbot.robot.spec import GRAVITY

Array = np.ndarray
Belief = tuple[Array, Array]


def jacobian(function: Callable[[Array], Array], at: Array) -> Array:
    """Return the Jacobian (m, n) of a function at a point (n,)."""
    h = 1e-30
    return np.array([function(at + 1j * h * step).imag / h for step in np.eye(at.size)]).T


def moved(x: Array, u: Array, seconds: float, separation: float) -> Array:
    """Return the state after inputs (6,): wheel travels, rotations about x and y, slides to the left and up."""
    left, right = u[0] * (1.0 + x[LEFT]), u[1] * (1.0 + x[RIGHT])
    turn, step = (right - left) / (separation * (1.0 + x[SEPARATION])), 0.5 * (left + right)
    chord = step * np.sin(0.5 * turn) / (0.5 * turn)
    ahead = np.array([chord * np.cos(0.5 * turn), chord * np.sin(0.5 * turn) + u[4], u[5]])
    (cr, cp, cy), (sr, sp, sy) = np.cos(x[ROLL : YAW + 1]), np.sin(x[ROLL : YAW + 1])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    about_y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    about_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    p, q = u[2] - x[GYRO_BIAS_X] * seconds, u[3] - x[GYRO_BIAS_Y] * seconds
    euler = [p + (q * sr + turn * cr) * sp / cp, q * cr - turn * sr, (q * sr + turn * cr) / cp]
    after = np.array(x, dtype=complex)
    after[:3] += about_z @ about_y @ about_x @ ahead
    after[ROLL : YAW + 1] += euler
    after[[DELTA_S, DELTA_YAW, DELTA_YAW_GYRO]] += [step, turn, turn]
    return after


def predicted(belief: Belief, u: Array, Q: Array, seconds: float, separation: float) -> Belief:
    """Return x' = f(x, u) and P' = F P F^T + G Q G^T."""
    x, P = belief
    F = jacobian(lambda at: moved(at, u, seconds, separation), x)
    G = jacobian(lambda at: moved(x, at, seconds, separation), u)
    return moved(x, u, seconds, separation).real, F @ P @ F.T + G @ Q @ G.T


def updated(
    belief: Belief, z: Array, h: Callable[[Array], Array], R: Array, estimated: Array = ALL
) -> Belief:
    """Return the belief after a measurement: K = P H^T S^-1, in Joseph's form with consider states."""
    x, P = belief
    H = jacobian(h, x)
    K = np.where(estimated[:, None], P @ H.T @ np.linalg.inv(H @ P @ H.T + R), 0.0)
    A = np.eye(SIZE) - K @ H
    return x + K @ (z - h(x).real), A @ P @ A.T + K @ R @ K.T


def without(belief: Belief, i: int) -> Belief:
    """Return the belief with element i reset to an exact zero."""
    x, P = belief[0].copy(), belief[1].copy()
    x[i] = P[i] = P[:, i] = 0.0
    return x, P


def filtered(
    belief: Belief,
    body: DriveModel,
    rolled: WheelTravel,
    dt: float,
    last: tuple[float, float, float],
    gyro_s: float,
    standing: bool,
    tilt: tuple[Array, Array],
    readings: Sequence[tuple[float, ImuReading]],
) -> Belief:
    """Return the belief after an interval of dt seconds with readings at their times in it.

    last: mean speed, yaw rate and duration of the interval before. gyro_s: time of the last gyro reading.
    tilt: rates about x and y at the beginning, with their variances.
    """
    x, P = without(without(belief, DELTA_S), DELTA_YAW)
    P[range(GYRO_BIAS_X, GYRO_BIAS_Z + 1), range(GYRO_BIAS_X, GYRO_BIAS_Z + 1)] += body.gyro_bias_walk**2 * dt
    belief, now, (rates, variances) = (x, P), 0.0, tilt
    for time, reading in readings:
        rates, variances = np.array(reading.rates[:2]), np.array(reading.rates_variance[:2])
        if standing:
            belief = updated(
                belief, rates, lambda x: x[[GYRO_BIAS_X, GYRO_BIAS_Y]], np.diag(variances), TILT_STATES
            )
        belief = part(belief, body, rolled, dt, time - now, rates, variances, standing)
        period, now = time - gyro_s, time
        belief = by_gyro(belief, reading, period)
        belief = without(belief, DELTA_YAW_GYRO)
        belief = by_accelerometer(belief, body, rolled, dt, last, standing, reading)
        belief = by_attitude(belief, reading)
        gyro_s = time
    return part(belief, body, rolled, dt, dt - now, rates, variances, standing) if now < dt else belief


def part(
    belief: Belief,
    body: DriveModel,
    rolled: WheelTravel,
    dt: float,
    seconds: float,
    rates: Array,
    variances: Array,
    standing: bool,
) -> Belief:
    """Return the belief after some seconds of the interval; a standing robot does not tilt."""
    share, gyro_s = seconds / dt, 0.0 if standing else seconds
    u = np.array([rolled.left * share, rolled.right * share, *(rates * gyro_s), 0.0, 0.0])
    wheels = np.array([rolled.left_variance, rolled.right_variance]) * share
    Q = np.diag([*wheels, *(variances * gyro_s**2), rolled.slide * share, rolled.slide * share])
    Q[0, 1] = Q[1, 0] = rolled.shared * share
    return predicted(belief, u, Q, gyro_s, body.separation)


def by_gyro(belief: Belief, reading: ImuReading, period: float) -> Belief:
    """Return the belief after the rotation about z."""

    def h(x: Array) -> Array:
        return np.array([(1.0 + x[GYRO_SCALE]) * x[DELTA_YAW_GYRO] + x[GYRO_BIAS_Z] * period])

    R = np.array([[reading.rates_variance[2] * period**2]])
    return updated(belief, np.array([reading.rates[2] * period]), h, R)


def by_accelerometer(
    belief: Belief,
    body: DriveModel,
    rolled: WheelTravel,
    dt: float,
    last: tuple[float, float, float],
    standing: bool,
    reading: ImuReading,
) -> Belief:
    """Return the belief after the specific force along x and y."""
    v, w = 0.5 * (rolled.left + rolled.right) / dt, (rolled.right - rolled.left) / body.separation / dt
    between = 0.5 * (dt + last[2])
    dv, dw = (v - last[0]) / between, (w - last[1]) / between

    def h(x: Array) -> Array:
        ax = dv - w * w * body.imu_x - dw * body.imu_y - GRAVITY * np.sin(x[PITCH]) + x[ACCEL_BIAS_X]
        ay = v * w - w * w * body.imu_y + dw * body.imu_x + x[ACCEL_BIAS_Y]
        return np.array([ax, ay + GRAVITY * np.cos(x[PITCH]) * np.sin(x[ROLL])])

    R = np.diag(reading.force_variance[:2])
    if not standing:
        R += np.eye(2) * (VIBRATION**2 + dw**2 * (body.imu_x**2 + body.imu_y**2))
        speed_variance = 0.25 * (rolled.left_variance + rolled.right_variance + 2.0 * rolled.shared) / dt**2
        R[0, 0] += 2.0 * speed_variance / between**2
    return updated(belief, np.array(reading.force[:2]), h, R, TILT_STATES)


def by_attitude(belief: Belief, reading: ImuReading) -> Belief:
    """Return the belief after roll, pitch and yaw."""
    R = np.diag(reading.attitude_variance)
    return updated(belief, np.array(reading.attitude), lambda x: x[ROLL : YAW + 1], R)
