"""Conversions between messages and the readings and estimates of odometry."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
    Vector3,
    covariance_36,
)
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Header
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.readings import UNMEASURED_VARIANCES, ImuReading, Triple
from chefbot.robot.section import Mount
from chefbot.robot.spec import Robot

Matrix = list[list[float]]
_FORWARD_AND_TURN = np.array([0, 5, 30, 35])
"""Indices of the covariances of v_x and w among the 36 of a twist."""


class ImuConverter:
    """Converts messages of the robot's IMU to readings in the robot's axes."""

    def __init__(self, robot: Robot) -> None:
        imu = robot.sensors.imu
        self._rotation: Matrix = mount_rotation(imu.mount).tolist()
        self._gyro_variances = self._rotated_diagonal(_isotropic(imu.gyro_noise**2))
        self._accelerometer_variances = self._rotated_diagonal(_isotropic(imu.accelerometer_noise**2))

    def reading(self, imu: Imu) -> ImuReading:
        """Return the reading of a message; variances that it does not have are those of the robot file."""
        return ImuReading(
            imu.header.stamp.ns,
            self._to_base_axes(imu.angular_velocity),
            self._variances(imu.angular_velocity_covariance, self._gyro_variances),
            self._to_base_axes(imu.linear_acceleration),
            self._variances(imu.linear_acceleration_covariance, self._accelerometer_variances),
        )

    def _to_base_axes(self, vector: Vector3) -> Triple:
        x, y, z = vector.x, vector.y, vector.z
        a, b, c = self._rotation
        return (
            a[0] * x + a[1] * y + a[2] * z,
            b[0] * x + b[1] * y + b[2] * z,
            c[0] * x + c[1] * y + c[2] * z,
        )

    def _variances(self, covariance: NDArray[np.float64], unknown: Triple) -> Triple:
        """Return the variances along the robot's axes, or `unknown` if the message has none.

        sensor_msgs/Imu: all zeros mean unknown, a first element of -1 means that there is no such sensor.
        """
        elements = covariance.tolist()
        if elements[0] < 0.0:
            return UNMEASURED_VARIANCES
        return self._rotated_diagonal(elements) if any(elements) else unknown

    def _rotated_diagonal(self, covariance: list[float]) -> Triple:
        """Return the diagonal of R C R^T for a covariance C of 9 elements."""
        a, b, c = self._rotation
        return _variance_along(a, covariance), _variance_along(b, covariance), _variance_along(c, covariance)


def _variance_along(axis: list[float], c: list[float]) -> float:
    """Return a^T C a for an axis (3,) and a covariance of 9 elements."""
    x, y, z = axis
    by_x = x * c[0] + y * c[1] + z * c[2]
    by_y = x * c[3] + y * c[4] + z * c[5]
    by_z = x * c[6] + y * c[7] + z * c[8]
    return x * by_x + y * by_y + z * by_z


def _isotropic(variance: float) -> list[float]:
    """Return a covariance of 9 elements with the same variance along all axes."""
    return [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]


def odometry_message(stamp_ns: int, estimate: MotionEstimate) -> Odometry:
    """Return the pose of base_footprint in the frame `odom`, and the twist, with their covariances."""
    pose = PoseWithCovariance(Pose.of(estimate.pose), covariance_36(estimate.covariance))
    # v_x, v_y, w: v_y is exactly 0
    covariance = np.zeros(36)
    covariance[_FORWARD_AND_TURN] = estimate.twist_covariance.reshape(4)
    twist = TwistWithCovariance(Twist.of(estimate.v, estimate.w), covariance)
    return Odometry(Header.of(stamp_ns, "odom"), "base_footprint", pose, twist)


def mount_rotation(mount: Mount) -> NDArray[np.float64]:
    """Return base_R_sensor (3, 3) of a mount: rotated by yaw, then by pitch about its own y axis."""
    c, s, cp, sp = math.cos(mount.yaw), math.sin(mount.yaw), math.cos(mount.pitch), math.sin(mount.pitch)
    return np.array([[c * cp, -s, c * sp], [s * cp, c, s * sp], [-sp, 0.0, cp]])
