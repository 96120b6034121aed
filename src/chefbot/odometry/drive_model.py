"""The numbers of a robot that its odometry works with."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from chefbot.odometry.motion_model import (
    BIAS_X,
    BIAS_Y,
    BIAS_Z,
    FORCE_X,
    FORCE_Y,
    GAIN,
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
from chefbot.robot.spec import Robot

SPEED_MARGIN = 1.5
"""Nobody turns a geared wheel faster than this many times its no-load speed."""
TURN_MARGIN = 3.0
"""A reading of so many times the motors' fastest turn is a damaged one."""
LEVEL = math.radians(1.0)
"""Standard deviation of a floor's slope where nothing measures it, rad; as an indoor floor has it."""
FORCE_BIAS = 0.5
"""Standard deviation of an accelerometer's offset, m/s^2: 0.05 g, the zero-g tolerance of an MPU-6050."""
GYRO_RANGE = math.radians(250.0)
"""rad/s: the narrowest range of the gyros in use (MPU-6050 register map, FS_SEL 0), as it is after power-up."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """A base on two wheels, and how badly the numbers are known (standard deviations).

    separation m; metres_per_tick m; fastest_rim m/s; fastest_turn rad/s and hardest_turn rad/s^2 are beyond
    what drive and slip explain; imu_x, imu_y: where the accelerometer sits, m; gyro_noise rad/s; gyro_bias
    rad/s; slip m per root of a metre; the errors are shares.
    """

    separation: float
    metres_per_tick: float = 1.0
    counter_bits: int = 64
    slip: float = 0.0
    diameter_error: float = 0.0
    separation_error: float = 0.0
    fastest_rim: float
    fastest_turn: float
    hardest_turn: float
    imu_x: float = 0.0
    imu_y: float = 0.0
    gyro_noise: float
    gyro_bias: float
    gyro_gain_error: float = 0.0
    gyro_bias_walk: float
    gyro_range: float = GYRO_RANGE
    tilt: float = LEVEL
    """Of roll and pitch at the start, rad."""
    heading: float = 0.0
    """Of yaw at the start, rad: 0 if odom points ahead by definition, pi if a sensor knows where it points."""
    measured: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """What a calibration found: shares of left and right wheel, separation and gyro's sensitivity; rad/s."""

    def __post_init__(self) -> None:
        if not 2 <= self.counter_bits <= 64:
            raise ValueError(f"a counter of {self.counter_bits} bits is none")

    @classmethod
    def of(cls, robot: Robot, params: OdometryParams, counter_bits: int = 64) -> Body:
        """From a robot file; `counter_bits` is the width of the board's counters, which may wrap."""
        imu, rim = robot.sensors.imu, robot.motor.no_load_speed * robot.wheel_radius
        found = robot.calibration
        factors = (found.left_wheel, found.right_wheel, found.separation, found.gyro_scale)
        left, right, separation, gain = (factor - 1.0 for factor in factors)
        return cls(
            separation=robot.wheels.separation,
            metres_per_tick=robot.metres_per_tick,
            counter_bits=counter_bits,
            slip=params.slip,
            diameter_error=found.wheel_deviation or params.diameter_error,
            separation_error=found.separation_deviation or params.separation_error,
            fastest_rim=SPEED_MARGIN * rim,
            fastest_turn=TURN_MARGIN * 2.0 * rim / robot.wheels.separation,
            hardest_turn=TURN_MARGIN * robot.drive.max_turn_acceleration,
            imu_x=imu.mount.x,
            imu_y=imu.mount.y,
            gyro_noise=imu.gyro_noise,
            gyro_bias=imu.gyro_bias,
            gyro_gain_error=found.gyro_deviation or params.gyro_gain_error,
            gyro_bias_walk=params.gyro_bias_walk,
            measured=(left, right, separation, gain, found.gyro_offset),
        )

    def start(self) -> tuple[Array, Array]:
        """State and covariance at the origin, whose place is exact by definition of the odom frame."""
        deviation = np.zeros(SIZE)
        deviation[[LEFT, RIGHT]] = self.diameter_error
        deviation[SEPARATION] = self.separation_error
        deviation[GAIN] = self.gyro_gain_error
        deviation[[BIAS_X, BIAS_Y, BIAS_Z]] = self.gyro_bias
        deviation[[FORCE_X, FORCE_Y]] = FORCE_BIAS
        deviation[[ROLL, PITCH]], deviation[YAW] = self.tilt, self.heading
        state = np.zeros(SIZE)
        state[[LEFT, RIGHT, SEPARATION, GAIN, BIAS_Z]] = self.measured
        return state, np.diag(deviation**2)
