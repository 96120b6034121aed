"""Wheel and gyro fusion for a loop that reads both sensors at the same time."""

from __future__ import annotations

import math

from chefbot.odometry.dead_reckoning import DeadReckoning
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.motion_model import GYRO_BIAS_Z, LEFT, SEPARATION, Array
from chefbot.odometry.readings import ImuReading, WheelCounts
from chefbot.odometry.sensor_health import SensorMonitor, Source


class GyroEkf(DeadReckoning):
    """An EKF over encoder counts and yaw rates that also estimates the errors of wheels and gyro.

    It is `ekf.Ekf` for synchronous readings without stamps. When a gyro reading is missing it continues with
    the wheels and the covariance grows accordingly; `gyro_age` reports it. When gyro and wheels contradict
    each other, the wheels slip: the gyro is used, the covariance grows, and `slipping` reports it.
    """

    def update(  # type: ignore[override]
        self, ticks_left: int, ticks_right: int, gyro_z: float | None, dt: float
    ) -> MotionEstimate:
        """Update with counts read `dt` > 0 seconds after the last ones, and the mean yaw rate since, rad/s,
        or None."""
        stamp_ns = self._advance_clock(dt)
        if gyro_z is not None:
            variance = (math.inf, math.inf, self._body.gyro_noise**2)
            self._process(ImuReading(stamp_ns, (0.0, 0.0, gyro_z), variance))
        return self._process(WheelCounts(stamp_ns, ticks_left, ticks_right))

    @property
    def gyro(self) -> SensorMonitor:
        """Fault monitor of the gyro."""
        return self.belief.monitors[Source.GYRO]

    @property
    def gyro_age(self) -> float:
        """Age of the last gyro reading that was used, s; 0 when the last update had one, infinite if none
        was."""
        used = self.gyro.used_ns
        return math.inf if used is None else (self._now_ns - used) / 1e9

    @property
    def on_wheels_only(self) -> bool:
        """Whether the last update had no gyro reading that it could use."""
        return self.gyro_age > 0.0

    @property
    def slipping(self) -> bool:
        """Whether wheels and gyro contradicted each other in the last update."""
        return self.belief.contradicted_ns is not None

    @property
    def gyro_bias(self) -> tuple[float, float]:
        """Estimated bias of the gyro and its standard deviation, rad/s."""
        variance = self.belief.covariance[GYRO_BIAS_Z, GYRO_BIAS_Z]
        return float(self.belief.state[GYRO_BIAS_Z]), math.sqrt(variance)

    @property
    def calibration(self) -> tuple[Array, Array]:
        """Relative errors of (left diameter, right diameter, separation), and their covariance (3, 3)."""
        shares = slice(LEFT, SEPARATION + 1)
        return self.belief.state[shares].copy(), self.belief.covariance[shares, shares].copy()
