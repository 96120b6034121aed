"""Propagation between two wheel readings, split at the readings of the other sensors."""

from __future__ import annotations

import math

import numpy as np

from chefbot.errors import OdometryError
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.filter_state import FilterState, MeanVelocity
from chefbot.odometry.kalman_update import ALL, CHI2_GATE, Flags, correct, distance, forget
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
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.odometry.wheel_travel import WheelTravel

GYRO_TIMEOUT_NS = 100_000_000
"""Longest time before or after a gyro reading for which its rate is used, ns."""
SLOPE_TIME_CONSTANT = 1.0
"""Time constant of the floor slope under a driving robot without a gyro, s: a tile or two at walking
speed."""
MAX_CONSECUTIVE_OUTLIERS = {Source.ATTITUDE: 5, Source.ACCELEROMETER: 50}
"""Outliers in a row after which a source is accepted, because then the estimate is wrong. The accelerometer
observes the attitude only indirectly, and a push lasts longer than an outlier."""

SLIP_INFLATION = 25.0
"""Factor from the squared slip to the variance of a slipping wheel: large enough that the contradiction
passes the gate and hardly changes the calibration states that were estimated before."""


def selection_jacobian(states: tuple[int, ...]) -> Array:
    """Return the Jacobian H (m, n) of a reading that measures these states directly."""
    H = np.zeros((len(states), SIZE))
    H[range(len(states)), states] = 1.0
    return H


class PropagationInterval:
    """The propagation of a belief over `dt_ns` > 0 between two wheel readings, at constant wheel speeds.

    rolled: travel of the wheels over the whole interval, with its covariance. Readings of the other sensors
    are applied in between, at their stamps.
    """

    def __init__(
        self, body: DriveModel, belief: FilterState, rolled: WheelTravel, dt_ns: int, standing: bool
    ) -> None:
        if belief.stamp_ns is None:
            raise OdometryError("the belief has no stamp to propagate from")
        self.model, self.last, self.standing = body, belief.velocity, standing
        self.monitors = dict(belief.monitors)
        self.gyro_ns, self.spike_candidates, self.tilt_reading = (
            belief.gyro_ns,
            belief.spike_candidates,
            belief.tilt_reading,
        )
        self.contradicted = False
        self._rolled, self._dt, self._now_ns = rolled, dt_ns / 1e9, belief.stamp_ns
        # Mean velocities of the interval
        turn = (rolled.right - rolled.left) / body.separation
        self.velocity = MeanVelocity(0.5 * (rolled.left + rolled.right) / self._dt, turn / self._dt, self._dt)
        # Reset the increments; random walk of the gyro biases, Q = walk^2 dt
        self.state, self.covariance = forget(*forget(belief.state, belief.covariance, DELTA_S), DELTA_YAW)
        for bias in (GYRO_BIAS_X, GYRO_BIAS_Y, GYRO_BIAS_Z):
            self.covariance[bias, bias] += body.gyro_bias_walk**2 * self._dt
        self._prior, self._part_dt = (self.state, self.covariance), 0.0

    @property
    def speed_variance(self) -> float:
        """Variance of the mean speed from the wheels, (m/s)^2."""
        rolled = self._rolled
        return 0.25 * (rolled.left_variance + rolled.right_variance + 2.0 * rolled.shared) / self._dt**2

    def move_to(self, stamp_ns: int) -> None:
        """Propagate to this stamp by the wheels (EKF prediction)."""
        self._prior, self._part_dt = (self.state, self.covariance), 0.0
        if stamp_ns <= self._now_ns:
            return
        if self.tilt_reading is not None and stamp_ns - self.tilt_reading.stamp_ns > GYRO_TIMEOUT_NS:
            self.tilt_reading = None
        self._part_dt, self._now_ns = (stamp_ns - self._now_ns) / 1e9, stamp_ns
        self.state, self.covariance = self._predict_part(0.0)
        self._expect_changes()

    def slip(self, error: float) -> None:
        """Repeat the last prediction with wheels whose yaw increment is wrong by `error`, rad.

        Either wheel may have slipped, so the travel is uncertain by half the slip to either side.
        """
        # Slip at the ground from the yaw error: error * l
        self.state, self.covariance = self._predict_part(error * self.model.separation)

    def _predict_part(self, slip: float) -> tuple[Array, Array]:
        """Return the prediction over the last part of the interval, with one wheel slipping by `slip`
        metres."""
        seconds, settling, gyro_seconds, rotation = self._part_dt, 0.0, 0.0, np.zeros(2)
        share, noise = seconds / self._dt, self._wheel_noise(slip)
        # Roll and pitch from the gyro, or else from the slope model of the floor
        if self.tilt_reading is not None:
            gyro_seconds, rotation = seconds, np.array(self.tilt_reading.rates[:2]) * seconds
            noise[2, 2], noise[3, 3] = (v * seconds**2 for v in self.tilt_reading.rates_variance[:2])
        elif not self.standing:
            settling = 1.0 - math.exp(-seconds / SLOPE_TIME_CONSTANT)
        # x' = f(x, u), P' = F P F^T + G Q G^T
        travel = np.array([self._rolled.left, self._rolled.right]) * share
        floor = (self.model.separation, settling, self.model.tilt)
        return predict(*self._prior, travel, rotation, gyro_seconds, noise, *floor)

    def _wheel_noise(self, slip: float) -> Array:
        """Return the wheels' part of the input covariance Q (6, 6) for the last part of the interval."""
        rolled, share = self._rolled, self._part_dt / self._dt
        noise = np.zeros((INPUTS, INPUTS))
        # Slip in the common mode (travel) and in the differential mode (yaw)
        travel, yaw = 0.25 * slip**2, SLIP_INFLATION * slip**2
        noise[0, 0] = rolled.left_variance * share + travel + yaw
        noise[1, 1] = rolled.right_variance * share + travel + yaw
        noise[0, 1] = noise[1, 0] = rolled.shared * share + travel - yaw
        # Slides to the left and up
        noise[4, 4] = noise[5, 5] = rolled.slide * share
        return noise

    def _expect_changes(self) -> None:
        """Add the wheel motion of the last part to the change expected from sensors whose readings repeat."""
        acceleration = (self.velocity.speed - self.last.speed) / self._dt if self.last else 0.0
        expected_rates = {
            Source.ATTITUDE: self.velocity.turn,
            Source.ACCELEROMETER: acceleration,
        }
        for source, rate in expected_rates.items():
            if self.monitors[source].repeating:
                self.monitors[source] = self.monitors[source].with_expected_change(rate * self._part_dt)

    def correct(self, innovation: Array, H: Array, noise: Array, estimated: Flags = ALL) -> None:
        """Apply a measurement update with `innovation` (m,), Jacobian H (m, n) and noise R (m, m).

        estimated (n,): mask of the elements of the state that may change.
        """
        self.state, self.covariance = correct(self.state, self.covariance, innovation, H, noise, estimated)

    def distance(self, innovation: Array, H: Array, noise: Array) -> tuple[float, Array]:
        """Return the squared Mahalanobis distance of an innovation (m,), and its covariance S (m, m)."""
        return distance(self.covariance, innovation, H, noise)

    def gated_update(
        self,
        source: Source,
        innovation: Array,
        H: Array,
        noise: Array,
        inflated_states: tuple[int, ...],
        estimated: Flags = ALL,
    ) -> None:
        """Apply a measurement update if the innovation passes the gate.

        inflated_states (m,): states whose covariance is inflated if the source stays outside the gate for
        `MAX_CONSECUTIVE_OUTLIERS` readings.
        """
        watch = self.monitors[source]
        self.monitors[source] = watch.with_rejected()
        if watch.fault is Condition.STUCK or not np.isfinite(innovation).all():
            return
        # Chi-square gate: y^T S^-1 y <= GATE
        distance_squared, S = self.distance(innovation, H, noise)
        if distance_squared > CHI2_GATE:
            if watch.refused_run < MAX_CONSECUTIVE_OUTLIERS[source]:
                return
            # A persistent contradiction: inflate P until the innovation is on the gate
            self._inflate_covariance(
                H[:, list(inflated_states)], S * (distance_squared / CHI2_GATE), inflated_states
            )
        # Measurement update
        self.correct(innovation, H, noise, estimated)
        self.monitors[source] = watch.used()

    def _inflate_covariance(self, jacobian: Array, added: Array, states: tuple[int, ...]) -> None:
        """Add H^-1 C H^-T to the covariance, so that the innovation lies at sqrt(GATE) standard
        deviations."""
        inverse = np.linalg.inv(jacobian)
        self.covariance = self.covariance.copy()
        self.covariance[np.ix_(states, states)] += inverse @ added @ inverse.T

    def add_heading(self, angle: float) -> None:
        """Add an angle, rad, that the wheels did not measure to the heading."""
        self.state = self.state.copy()
        self.state[[YAW, DELTA_YAW]] += angle

    def inflate_heading(self, variance: float) -> None:
        """Add a variance, rad^2, to the heading and to the yaw increment."""
        self.covariance = self.covariance.copy()
        for i in (YAW, DELTA_YAW):
            for j in (YAW, DELTA_YAW):
                self.covariance[i, j] += variance
