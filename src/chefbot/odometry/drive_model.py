"""The parameters of a differential drive and its IMU that the odometry uses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from chefbot.errors import OdometryError
from chefbot.odometry.motion_model import (
    ACCEL_BIAS_X,
    ACCEL_BIAS_Y,
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
    Array,
)
from chefbot.odometry.params import OdometryParams
from chefbot.robot.motion_limits import max_turn_deceleration, no_load_wheel_speed, turn_rate_on_spot
from chefbot.robot.spec import Robot

SPEED_MARGIN = 1.5
"""Factor on the no-load speed beyond which encoder counts are invalid."""
TURN_MARGIN = 3.0
"""Factor on the maximum yaw rate of the drive beyond which a gyro reading is damaged."""
FLOOR_SLOPE = math.radians(1.0)
"""Standard deviation of the slope of an indoor floor when no sensor measures it, rad."""
ACCEL_BIAS = 0.5
"""Standard deviation of the accelerometer bias, m/s^2: 0.05 g, the zero-g tolerance of an MPU-6050."""
GYRO_RANGE = math.radians(250.0)
"""Narrowest range of the gyros in use, rad/s (MPU-6050 register map, FS_SEL 0), the default after
power-up."""


class FilterParameters(NamedTuple):
    """The numbers of a `DriveModel` that the compiled filter needs, in the same units."""

    separation: float
    max_yaw_rate: float
    max_yaw_acceleration: float
    imu_x: float
    imu_y: float
    imu_distance: float
    """Distance of the accelerometer from the axle midpoint, m."""
    gyro_bias_walk: float
    gyro_range: float
    tilt: float


@dataclass(frozen=True, kw_only=True)
class DriveModel:
    """The parameters of a differential drive base, with the standard deviations of their errors.

    separation m; metres_per_tick m; max_wheel_speed m/s, max_yaw_rate rad/s and max_yaw_acceleration rad/s^2: bounds
    of wheel speed at the ground, yaw rate and yaw acceleration, beyond which a reading is invalid; imu_x, imu_y:
    position of the accelerometer in base_link, m; gyro_noise rad/s; gyro_bias rad/s; slip m per square root
    of a metre; gyro_bias_walk rad/s in a second; gyro_range rad/s; the errors are relative (no unit).
    """

    separation: float
    metres_per_tick: float = 1.0
    counter_bits: int = 64
    slip: float = 0.0
    diameter_error: float = 0.0
    separation_error: float = 0.0
    max_wheel_speed: float
    max_yaw_rate: float
    max_yaw_acceleration: float
    imu_x: float = 0.0
    imu_y: float = 0.0
    gyro_noise: float
    gyro_bias: float
    gyro_scale_error: float = 0.0
    gyro_bias_walk: float
    gyro_range: float = GYRO_RANGE
    tilt: float = FLOOR_SLOPE
    """Standard deviation of roll and pitch at the start, rad."""
    heading: float = 0.0
    """Standard deviation of yaw at the start, rad: 0 if odom is aligned by definition, pi if a sensor
    measures yaw."""
    measured: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Relative errors by the calibration of left wheel, right wheel, separation and gyro scale, and the gyro
    bias, rad/s."""

    def __post_init__(self) -> None:
        if not 2 <= self.counter_bits <= 64:
            raise OdometryError(f"counter_bits must be 2 to 64, not {self.counter_bits}")

    @classmethod
    def of(cls, robot: Robot, params: OdometryParams | None = None, counter_bits: int = 64) -> DriveModel:
        """Return the model of a robot; `counter_bits` is the width of the board's counters, which may wrap
        around."""
        params = params or OdometryParams()
        imu, max_wheel_speed = robot.sensors.imu, no_load_wheel_speed(robot)
        calibration = robot.calibration
        factors = (
            calibration.left_wheel,
            calibration.right_wheel,
            calibration.separation,
            calibration.gyro_scale,
        )
        left, right, separation, gyro_scale_error = (factor - 1.0 for factor in factors)
        return cls(
            separation=robot.wheels.separation,
            metres_per_tick=robot.metres_per_tick,
            counter_bits=counter_bits,
            slip=params.slip,
            diameter_error=calibration.wheel_deviation or params.diameter_error,
            separation_error=calibration.separation_deviation or params.separation_error,
            max_wheel_speed=SPEED_MARGIN * max_wheel_speed,
            max_yaw_rate=TURN_MARGIN * turn_rate_on_spot(robot, max_wheel_speed),
            max_yaw_acceleration=TURN_MARGIN * max_turn_deceleration(robot),
            imu_x=imu.mount.x,
            imu_y=imu.mount.y,
            gyro_noise=imu.gyro_noise,
            gyro_bias=imu.gyro_bias,
            gyro_scale_error=calibration.gyro_deviation or params.gyro_scale_error,
            gyro_bias_walk=params.gyro_bias_walk,
            measured=(left, right, separation, gyro_scale_error, calibration.gyro_offset),
        )

    @cached_property
    def parameters(self) -> FilterParameters:
        """The numbers that the compiled filter needs."""
        return FilterParameters(
            float(self.separation),
            float(self.max_yaw_rate),
            float(self.max_yaw_acceleration),
            float(self.imu_x),
            float(self.imu_y),
            math.hypot(self.imu_x, self.imu_y),
            float(self.gyro_bias_walk),
            float(self.gyro_range),
            float(self.tilt),
        )

    def start(self) -> tuple[Array, Array]:
        """Return the initial state (n,) and covariance (n, n) at the origin of odom, which is exact by
        definition."""
        deviation = np.zeros(SIZE)
        deviation[[LEFT, RIGHT]] = self.diameter_error
        deviation[SEPARATION] = self.separation_error
        deviation[GYRO_SCALE] = self.gyro_scale_error
        deviation[[GYRO_BIAS_X, GYRO_BIAS_Y, GYRO_BIAS_Z]] = self.gyro_bias
        deviation[[ACCEL_BIAS_X, ACCEL_BIAS_Y]] = ACCEL_BIAS
        deviation[[ROLL, PITCH]], deviation[YAW] = self.tilt, self.heading
        state = np.zeros(SIZE)
        state[[LEFT, RIGHT, SEPARATION, GYRO_SCALE, GYRO_BIAS_Z]] = self.measured
        return state, np.diag(deviation**2)
