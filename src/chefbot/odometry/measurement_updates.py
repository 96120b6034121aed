"""Accelerometer, attitude and matched scans against the way by the wheels."""

from __future__ import annotations

import math

import numpy as np

from chefbot.maths.angles import wrap
from chefbot.odometry.gyro import LEAST_GYRO_NOISE, hear_gyro
from chefbot.odometry.kalman_update import GATE, Flags
from chefbot.odometry.motion_model import (
    BIAS_X,
    BIAS_Y,
    FORCE_X,
    FORCE_Y,
    PITCH,
    ROLL,
    SIZE,
    YAW,
    Array,
    X,
    Y,
    Z,
)
from chefbot.odometry.propagation import Leg, selecting
from chefbot.odometry.readings import ImuReading, PoseReading
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.robot.spec import GRAVITY

VIBRATION = 0.5
"""m/s^2: standard deviation of what a rolling robot's accelerometer feels besides. The two recordings that
robot_localization is tested with have 0.7 (a Husky on asphalt) and 0.9 (a Jackal in a simulator), with the
robot's own accelerations in it."""
FORCE_RANGE = 2.0 * GRAVITY
"""m/s^2: the narrowest range of the accelerometers in use (MPU-6050 register map, AFS_SEL 0)."""
SLOPING: Flags = np.zeros(SIZE, np.bool_)
"""What accelerometer and gyro about x and y may change. Their comparisons take wheels and stand as they are, so
they must not turn round and correct the plane's business by them: heading, wheels, gyro about z."""
SLOPING[[Z, ROLL, PITCH, BIAS_X, BIAS_Y, FORCE_X, FORCE_Y]] = True
LEAST_MATCH_NOISE = 1e-3
"""Metres and radians: no match of scans is better, and a covariance of zeros stands for one that nobody filled in."""
STUCK_TURN, STUCK_SPEED, STUCK_TRAVEL = 0.05, 0.1, 0.1
"""rad, m/s, m: what attitude, accelerometer and scans cannot have missed, if the wheels are right."""


def hear_imu(leg: Leg, reading: ImuReading) -> None:
    """Gyro, accelerometer and attitude at their instant."""
    tilts = _tells_tilt(leg, reading) and not _stands_still(leg, reading)
    leg.tilting = reading if tilts else None
    leg.move_to(reading.stamp_ns)
    hear_gyro(leg, reading)
    if math.isfinite(reading.force_variance[0]):
        _hear_force(leg, reading)
    if any(math.isfinite(v) for v in reading.attitude_variance):
        _hear_attitude(leg, reading)


def hear_pose(leg: Leg, reading: PoseReading) -> None:
    """A match of scans at its instant."""
    leg.move_to(reading.stamp_ns)
    before = leg.watches[Source.SCANS]
    leg.watches[Source.SCANS] = before.heard(reading.stamp_ns, tuple(reading.pose), STUCK_TRAVEL)
    x, y, yaw = reading.pose
    error = np.array([x - leg.state[X], y - leg.state[Y], wrap(yaw - leg.state[YAW])])
    axes = (X, Y, YAW)
    noise = np.array(reading.covariance) + LEAST_MATCH_NOISE**2 * np.eye(3)
    leg.weigh(Source.SCANS, error, selecting(axes), noise, axes)


def _tells_tilt(leg: Leg, reading: ImuReading) -> bool:
    told = all(math.isfinite(v) for v in reading.rates_variance[:2])
    sane = all(abs(rate) < leg.body.gyro_range for rate in reading.rates[:2])  # false for NaN
    return told and sane and leg.watches[Source.GYRO].flaw is Condition.FRESH


def _stands_still(leg: Leg, reading: ImuReading) -> bool:
    """The zero-velocity update about x and y: a standing robot's rates are the gyro's offsets.

    False if they are not: somebody tilts it.
    """
    if not leg.standing:
        return False
    axes = (BIAS_X, BIAS_Y)
    error = np.array(reading.rates[:2]) - leg.state[list(axes)]
    noise = np.diag([max(v, LEAST_GYRO_NOISE**2) for v in reading.rates_variance[:2]])
    if leg.distance(error, selecting(axes), noise)[0] > GATE:
        return False
    leg.correct(error, selecting(axes), noise, SLOPING)
    return True


def _hear_force(leg: Leg, reading: ImuReading) -> None:
    """The accelerometer's x and y: gravity along the tilted axes, and how the robot gathers speed."""
    value = np.array(reading.force[:2])
    watch = leg.watches[Source.ACCELEROMETER].heard(reading.stamp_ns, reading.force, STUCK_SPEED)
    leg.watches[Source.ACCELEROMETER] = watch
    if leg.last is None or leg.contradicted:
        return  # the wheels cannot say how the robot gathers speed
    if max(abs(value)) >= FORCE_RANGE:  # false for NaN, which is refused below
        leg.watches[Source.ACCELEROMETER] = watch.left_out(Condition.SATURATED)
        return
    expected, H, unrest = _expected_force(leg)
    noise = np.diag(np.array(reading.force_variance[:2]) + unrest)
    leg.weigh(Source.ACCELEROMETER, value - expected, H, noise, (PITCH, ROLL), SLOPING)


def _expected_force(leg: Leg) -> tuple[Array, Array, Array]:
    """Force (2,) along x and y, its derivative (2, n) by the state, and the variance (2,) of what is left out.

    The axle's middle feels (dv/dt, v w), a sensor at (x, y) from it -w^2 (x, y) besides, and dw/dt times its
    distance, of which only the size is known. Both feel gravity along the tilted axes.
    """
    state, pace, last, body = leg.state, leg.pace, leg.last or leg.pace, leg.body
    between = 0.5 * (pace.dt + last.dt)
    gathers, turns = (pace.speed - last.speed) / between, (pace.turn - last.turn) / between
    sr, cr, sp, cp = (f(state[i]) for i in (ROLL, PITCH) for f in (math.sin, math.cos))
    along = gathers - pace.turn**2 * body.imu_x - turns * body.imu_y - GRAVITY * sp + state[FORCE_X]
    aside = pace.turn * (pace.speed - pace.turn * body.imu_y) + turns * body.imu_x
    aside += GRAVITY * cp * sr + state[FORCE_Y]
    H = selecting((FORCE_X, FORCE_Y))
    H[0, PITCH], H[1, ROLL], H[1, PITCH] = -GRAVITY * cp, GRAVITY * cp * cr, -GRAVITY * sp * sr
    unrest = np.zeros(2)
    if not leg.standing:
        unrest += VIBRATION**2 + (turns * math.hypot(body.imu_x, body.imu_y)) ** 2
        unrest[0] += 2.0 * leg.speed_variance / between**2
    return np.array([along, aside]), H, unrest


def _hear_attitude(leg: Leg, reading: ImuReading) -> None:
    """Roll, pitch and yaw as far as the sensor tells them."""
    before = leg.watches[Source.ATTITUDE]
    leg.watches[Source.ATTITUDE] = before.heard(reading.stamp_ns, reading.attitude, STUCK_TURN)
    told = [i for i in range(3) if math.isfinite(reading.attitude_variance[i])]
    error = np.array([wrap(reading.attitude[i] - leg.state[ROLL + i]) for i in told])
    axes = tuple(ROLL + i for i in told)
    noise = np.diag([reading.attitude_variance[i] for i in told])
    leg.weigh(Source.ATTITUDE, error, selecting(axes), noise, axes)
