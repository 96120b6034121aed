"""Wheels and a gyro in lockstep: the filter for a loop that reads both at once."""

from __future__ import annotations

import math

from chefbot.odometry.dead_reckoning import DeadReckoning
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.motion_model import BIAS_Z, LEFT, SEPARATION, Array
from chefbot.odometry.readings import ImuReading, WheelCounts
from chefbot.odometry.sensor_health import Source, Watch


class GyroEkf(DeadReckoning):
    """Pose from encoder counts and turn rates, with the errors of wheels and gyro estimated on the way.

    It is `ekf.Ekf` for those who have no stamps and nothing late. When a gyro reading is missing it goes on with
    the wheels and the covariance grows as it should; `gyro_age` tells. When gyro and wheels contradict each
    other, the wheels slip: the gyro is believed, the covariance grows, and `slipping` tells.
    """

    def update(  # type: ignore[override]
        self, ticks_left: int, ticks_right: int, gyro_z: float | None, dt: float
    ) -> MotionEstimate:
        """Counts read `dt` > 0 seconds after the last ones, and the turn rate over these, rad/s, or None."""
        stamp_ns = self._later(dt)
        if gyro_z is not None:
            variance = (math.inf, math.inf, self._body.gyro_noise**2)
            self._tell(ImuReading(stamp_ns, (0.0, 0.0, gyro_z), variance))
        return self._tell(WheelCounts(stamp_ns, ticks_left, ticks_right))

    @property
    def gyro(self) -> Watch:
        """What the gyro has shown of its health."""
        return self.belief.watches[Source.GYRO]

    @property
    def gyro_age(self) -> float:
        """Seconds since the last reading that was used; 0 when the last update had one."""
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
        """The estimated offset and its standard deviation, rad/s."""
        variance = self.belief.covariance[BIAS_Z, BIAS_Z]
        return float(self.belief.state[BIAS_Z]), math.sqrt(variance)

    @property
    def calibration(self) -> tuple[Array, Array]:
        """Errors of (left diameter, right diameter, separation) as shares, and their covariance (3, 3)."""
        shares = slice(LEFT, SEPARATION + 1)
        return self.belief.state[shares].copy(), self.belief.covariance[shares, shares].copy()
