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
from chefbot.odometry.readings import ImuReading, Triple
from chefbot.robot.section import Mount
from chefbot.robot.spec import Robot


class ImuConverter:
    """Converts messages of the robot's IMU to readings in the robot's axes."""

    def __init__(self, robot: Robot) -> None:
        self._spec = robot.sensors.imu
        self._rotation = mount_rotation(self._spec.mount)

    def reading(self, imu: Imu) -> ImuReading:
        """Return the reading of a message; variances that it does not have are those of the robot file."""
        return ImuReading(
            imu.header.stamp.ns,
            self._to_base_axes(imu.angular_velocity),
            self._variances(imu.angular_velocity_covariance, self._spec.gyro_noise),
            self._to_base_axes(imu.linear_acceleration),
            self._variances(imu.linear_acceleration_covariance, self._spec.accelerometer_noise),
        )

    def _to_base_axes(self, vector: Vector3) -> Triple:
        x, y, z = (self._rotation @ np.array([vector.x, vector.y, vector.z])).tolist()
        return x, y, z

    def _variances(self, covariance: NDArray[np.float64], noise: float) -> Triple:
        """Return the variances along the robot's axes, from the robot file if the message has none.

        sensor_msgs/Imu: all zeros mean unknown, a first element of -1 means that there is no such sensor.
        """
        if covariance[0] < 0.0:
            return math.inf, math.inf, math.inf
        matrix = covariance.reshape(3, 3) if covariance.any() else noise**2 * np.eye(3)
        x, y, z = (self._rotation @ matrix @ self._rotation.T).diagonal().tolist()
        return x, y, z


def odometry_message(stamp_ns: int, estimate: MotionEstimate) -> Odometry:
    """Return the pose of base_footprint in the frame `odom`, and the twist, with their covariances."""
    pose = PoseWithCovariance(Pose.of(estimate.pose), covariance_36(estimate.covariance))
    # v_x, v_y, w: v_y is exactly 0
    covariance = np.zeros((3, 3))
    covariance[::2, ::2] = estimate.twist_covariance
    twist = TwistWithCovariance(Twist.of(estimate.v, estimate.w), covariance_36(covariance))
    return Odometry(Header.of(stamp_ns, "odom"), "base_footprint", pose, twist)


def mount_rotation(mount: Mount) -> NDArray[np.float64]:
    """Return base_R_sensor (3, 3) of a mount: rotated by yaw, then by pitch about its own y axis."""
    c, s, cp, sp = math.cos(mount.yaw), math.sin(mount.yaw), math.cos(mount.pitch), math.sin(mount.pitch)
    return np.array([[c * cp, -s, c * sp], [s * cp, c, s * sp], [-sp, 0.0, cp]])
