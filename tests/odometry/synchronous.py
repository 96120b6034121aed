"""The filter for readings of wheels and gyro at the same time."""

import math

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.motion_model import GYRO_BIAS_Z, LEFT, SEPARATION, Array
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.readings import ImuReading, WheelCounts
from chefbot.odometry.sensor_health import SensorMonitor, Source
from chefbot.robot.spec import Robot


class SynchronousEkf(Ekf):
    """An `Ekf` whose readings need no stamps; without yaw rates it is dead reckoning."""

    def __init__(
        self,
        robot: Robot,
        params: OdometryParams | None = None,
        counter_bits: int = 64,
        start: SE2 = IDENTITY,
    ) -> None:
        self._drive = DriveModel.of(robot, params or OdometryParams(), counter_bits)
        self._now_ns = 0
        super().__init__(self._drive, start)

    def update(self, left: int, right: int, dt: float, gyro_z: float | None = None) -> MotionEstimate:
        """Update with counts read `dt` seconds after the last ones, and the mean yaw rate since, rad/s."""
        self._now_ns += round(dt * 1e9)
        if gyro_z is not None:
            variance = (math.inf, math.inf, self._drive.gyro_noise**2)
            self.add(ImuReading(self._now_ns, (0.0, 0.0, gyro_z), variance))
        self.add(WheelCounts(self._now_ns, left, right))
        return self.estimate

    @property
    def gyro(self) -> SensorMonitor:
        """Fault monitor of the gyro."""
        return self.belief.monitors[Source.GYRO]

    @property
    def gyro_age(self) -> float:
        """Age of the last gyro reading that was used, s."""
        return self.time_since_used(Source.GYRO, self._now_ns)

    @property
    def gyro_bias(self) -> tuple[float, float]:
        """Estimated bias of the gyro and its standard deviation, rad/s."""
        variance = self.belief.covariance[GYRO_BIAS_Z, GYRO_BIAS_Z]
        return float(self.belief.state[GYRO_BIAS_Z]), math.sqrt(variance)

    @property
    def calibration(self) -> tuple[Array, Array]:
        """Relative errors of (left diameter, right diameter, separation), and their covariance (3, 3)."""
        shares = slice(LEFT, SEPARATION + 1)
        return self.belief.state[shares], self.belief.covariance[shares, shares]
