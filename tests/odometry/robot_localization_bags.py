"""Reads the recordings of robot_localization's tests as readings for the filter.

Covariances are those of the messages; the axes of each source that are used are those of the settings of each bag.
The expected pose is used for comparison only.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from chefbot.maths.angles import wrap
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.readings import ImuReading, Reading, WheelTwist

MAX_SPEED, MAX_YAW_RATE, MAX_YAW_ACCELERATION = 2.0, 2.0, 10.0
"""m/s, rad/s, rad/s^2: at least the limits of Husky and Jackal (1.0 and 2.0 m/s by their data sheets)."""
BODY = DriveModel(
    separation=0.5,  # not used, as the recordings contain twists instead of counts
    max_wheel_speed=MAX_SPEED,
    max_yaw_rate=3.0 * MAX_YAW_RATE,
    max_yaw_acceleration=MAX_YAW_ACCELERATION,
    gyro_noise=0.01,  # not used, as each reading has its own
    gyro_bias=math.radians(1.0),
    gyro_bias_walk=2e-5,
    tilt=math.radians(10.0),  # outdoors
    heading=math.pi,  # the IMUs have magnetometers
)
MOUNTS = {
    1: np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    2: np.eye(3),
}
"""base_R_imu: by the launch file of bag 1 a roll of 90 deg, then a yaw of -90 deg."""


@dataclass(frozen=True)
class Recording:
    """Readings in the order of recording, the expected last position (3,), and its tolerance in metres."""

    readings: list[Reading]
    end: np.ndarray[Any, Any]
    tolerance: float


def load(folder: Path, number: int) -> Recording:
    """Read one of the two bags with its settings."""
    text = (folder / f"test_ekf_localization_node_bag{number}.yaml").read_text()
    settings = [node["ros__parameters"] for node in yaml.safe_load(text).values()]
    axes = {name[:-7]: chosen for name, chosen in settings[0].items() if name.endswith("_config")}
    expected = settings[1]
    end = np.array([expected[f"final_{axis}"] for axis in "xyz"])
    readings = list(_readings(folder / f"test{number}.bag", axes, MOUNTS[number]))
    return Recording(readings, end, expected["tolerance"])


def _readings(path: Path, axes: dict[str, list[bool]], mount: np.ndarray[Any, Any]) -> Iterator[Reading]:
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC)
    with Reader(path) as bag:
        for connection, _, raw in bag.messages():
            message: Any = types.deserialize_ros1(raw, connection.msgtype)
            if connection.topic == "/imu/data":
                yield _imu(message, axes["imu0"], mount)
            elif connection.topic.endswith("/odom"):
                yield _wheels(message, axes["odom0"])


def _stamp_ns(message: Any) -> int:
    return int(message.header.stamp.sec) * 1_000_000_000 + int(message.header.stamp.nanosec)


def _wheels(message: Any, axes: list[bool]) -> WheelTwist:
    variance = message.twist.covariance.reshape(6, 6).diagonal()
    yaw_rate_variance = (
        variance[5] if axes[11] else MAX_YAW_RATE**2
    )  # for an unused axis the largest possible variance
    twist = message.twist.twist
    lateral_variance = float(max(variance[1], variance[2]))
    return WheelTwist(
        _stamp_ns(message),
        float(twist.linear.x),
        float(twist.angular.z),
        float(variance[0]),
        float(yaw_rate_variance),
        lateral_variance,
    )


def _imu(message: Any, axes: list[bool], mount: np.ndarray[Any, Any]) -> ImuReading:
    def rotate(v: Any) -> tuple[float, float, float]:
        x, y, z = (mount @ np.array([v.x, v.y, v.z])).tolist()
        return x, y, z

    def variances_of(covariance: Any, chosen: list[bool]) -> tuple[float, float, float]:
        variances = (mount @ covariance.reshape(3, 3) @ mount.T).diagonal()
        a, b, c = (float(v) if on else math.inf for v, on in zip(variances, chosen, strict=True))
        return a, b, c

    return ImuReading(
        _stamp_ns(message),
        rotate(message.angular_velocity),
        variances_of(message.angular_velocity_covariance, axes[9:12]),
        rotate(message.linear_acceleration),
        variances_of(message.linear_acceleration_covariance, axes[12:15]),
        _attitude(message.orientation, mount),
        variances_of(message.orientation_covariance, axes[3:6]),
    )


def _attitude(q: Any, mount: np.ndarray[Any, Any]) -> tuple[float, float, float]:
    """Return roll, pitch, yaw of base_link from the orientation of the IMU and its mount."""
    w, x, y, z = q.w, q.x, q.y, q.z
    imu = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    base = imu @ mount.T
    roll, pitch = math.atan2(base[2, 1], base[2, 2]), math.asin(-base[2, 0])
    return roll, pitch, wrap(math.atan2(base[1, 0], base[0, 0]))
