"""Wheels and gyro together: an extended Kalman filter.

Wheels know that they stand, a gyro knows that it turns. A wheel slips and its diameter is a little wrong, a
gyro has an offset; each sees the fault of the other. At standstill the offset shows itself: the zero-velocity
update (Foxlin 2005) is the ordinary update with wheels that are sure.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.odometry.dead_reckoning import start_state, to_estimate
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.motion import SEPARATION, TURN, Array, predict
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.wheels import Wheels, WheelStep
from chefbot.robot.spec import Robot

BIAS, GAIN = SEPARATION + 1, SEPARATION + 2
GATE = 25.0
"""Squared standard deviations between wheels and gyro that chance explains: five of them."""
LEAST_GYRO_NOISE = 1e-5
"""rad/s; no gyro is finer, and a variance of zero has no inverse."""
IMPOSSIBLE_TURNS = 3.0
"""A reading of so many times the motors' fastest turn is a damaged one."""


@njit(cache=True, nogil=True)
def _innovation(state: Array, covariance: Array, angle: float, dt: float) -> tuple[float, float, Array]:
    """How far the gyro's angle is from the expected one, the variance H P H^T of that, and P H^T (n,).

    Expected: (1 + gain error) * turn + bias * dt, with the derivative H by turn, bias and gain error; the
    gyro's own noise is not in the variance yet.
    """
    by_turn = 1.0 + state[GAIN]
    spread = np.empty(state.size)
    for i in range(state.size):
        row = covariance[i]
        spread[i] = row[TURN] * by_turn + row[BIAS] * dt + row[GAIN] * state[TURN]
    variance = by_turn * spread[TURN] + dt * spread[BIAS] + state[TURN] * spread[GAIN]
    return angle - by_turn * state[TURN] - state[BIAS] * dt, variance, spread


@njit(cache=True, nogil=True)
def _correct(state: Array, covariance: Array, angle: float, dt: float, noise: float) -> tuple[Array, Array]:
    """State and covariance after the gyro's angle with variance `noise`, rad^2."""
    error, variance, spread = _innovation(state, covariance, angle, dt)
    corrected, certain = state.copy(), covariance.copy()
    for i in range(state.size):
        gain = spread[i] / (variance + noise)
        corrected[i] += gain * error
        for j in range(state.size):
            certain[i, j] = 0.5 * (covariance[i, j] + covariance[j, i]) - gain * spread[j]
    return corrected, certain


class GyroEkf:
    """Pose from encoder counts and turn rates, with the errors of wheels and gyro estimated on the way.

    When a gyro reading is missing the filter goes on with the wheels and the covariance grows as it should;
    `gyro_age` tells. When gyro and wheels contradict each other, the wheels slip: the gyro is believed,
    the covariance grows, and `slipping` tells.
    """

    def __init__(
        self,
        robot: Robot,
        params: OdometryParams | None = None,
        counter_bits: int = 64,
        start: SE2 = IDENTITY,
    ) -> None:
        params = params or OdometryParams()
        imu = robot.sensors.imu
        self.wheels = Wheels(robot, params, counter_bits)
        self._separation = robot.wheels.separation
        self._fastest_turn = 2.0 * robot.motor.no_load_speed * robot.wheel_radius / self._separation
        self._gyro_noise = max(imu.gyro_noise, LEAST_GYRO_NOISE)
        self._bias_walk = params.gyro_bias_walk
        self._state, self._covariance = start_state(start, params, GAIN + 1)
        self._covariance[BIAS, BIAS] = imu.gyro_bias**2
        self._covariance[GAIN, GAIN] = params.gyro_gain_error**2
        self.gyro_age = math.inf
        """Seconds since the last reading that was used; 0 when the last update had one."""
        self.slipping = False
        """Whether wheels and gyro contradicted each other in the last update."""
        self.gyro_rejected = 0
        """Readings so far that were not finite or faster than this robot can turn."""

    @property
    def on_wheels_only(self) -> bool:
        """Whether the last update had no gyro reading that it could use."""
        return self.gyro_age > 0.0

    @property
    def gyro_bias(self) -> tuple[float, float]:
        """The estimated offset and its standard deviation, rad/s."""
        return float(self._state[BIAS]), math.sqrt(self._covariance[BIAS, BIAS])

    @property
    def calibration(self) -> tuple[Array, Array]:
        """Errors of (left diameter, right diameter, separation) as shares, and their covariance (3, 3)."""
        shares = slice(SEPARATION - 2, SEPARATION + 1)
        return self._state[shares].copy(), self._covariance[shares, shares].copy()

    def update(self, ticks_left: int, ticks_right: int, gyro_z: float | None, dt: float) -> MotionEstimate:
        """Counts read `dt` > 0 seconds after the last ones, and the turn rate over these, rad/s, or None."""
        usable = self.wheels.started and gyro_z is not None and self._possible(gyro_z)
        step = self.wheels.step(ticks_left, ticks_right, dt)
        self._covariance[BIAS, BIAS] += self._bias_walk**2 * dt
        self.slipping = False
        if usable and gyro_z is not None:
            self.gyro_age = 0.0
            self._fuse(step, gyro_z * dt, dt)
        else:
            self.gyro_age += dt
            self._state, self._covariance = self._predicted(step, 0.0)
        return to_estimate(self._state, self._covariance, dt)

    def _possible(self, gyro_z: float) -> bool:
        possible = abs(gyro_z) <= IMPOSSIBLE_TURNS * self._fastest_turn  # false for NaN
        self.gyro_rejected += not possible
        return possible

    def _predicted(self, step: WheelStep, slip: float) -> tuple[Array, Array]:
        """State and covariance by the wheels, each with `slip` added to its variance, m^2."""
        variance = np.array([step.variance_left + slip, step.variance_right + slip])
        return predict(self._state, self._covariance, step.left, step.right, variance, self._separation)

    def _fuse(self, step: WheelStep, angle: float, dt: float) -> None:
        noise = (self._gyro_noise * dt) ** 2
        state, covariance = self._predicted(step, 0.0)
        error, variance, _ = _innovation(state, covariance, angle, dt)
        excess = error**2 / GATE - variance - noise
        if excess > 0.0:
            self.slipping = True
            # so much more variance per wheel makes the contradiction one of sqrt(GATE) deviations
            state, covariance = self._predicted(step, 0.5 * excess * self._separation**2)
        self._state, self._covariance = _correct(state, covariance, angle, dt, noise)
