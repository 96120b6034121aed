"""The recordings that robot_localization is tested with, as readings for our filter.

What is known comes from the messages: covariances, and from the settings beside each bag: which axes of which
source its authors let count. Of the expected pose nothing is used but to compare.
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

FASTEST_SPEED, FASTEST_TURN, HARDEST_TURN = 2.0, 2.0, 10.0
"""m/s, rad/s, rad/s^2: beyond what a Husky and a Jackal can do (their data sheets: 1.0 and 2.0 m/s)."""
BODY = DriveModel(
    separation=0.5,  # any: speeds are told, not counts
    max_wheel_speed=FASTEST_SPEED,
    max_yaw_rate=3.0 * FASTEST_TURN,
    max_yaw_acceleration=HARDEST_TURN,
    gyro_noise=0.01,  # never asked for: every reading tells its own
    gyro_bias=math.radians(1.0),
    gyro_bias_walk=2e-5,
    tilt=math.radians(10.0),  # on a street, not on a floor
    heading=math.pi,  # the IMUs have compasses
)
MOUNTS = {
    1: np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    2: np.eye(3),
}
"""base_R_imu: in bag 1 rolled by 90 deg, then turned by -90 deg about z, as its launch file says."""


@dataclass(frozen=True)
class Recording:
    """Readings in the order of recording, the expected last position (3,) and how far off it may be, m."""

    readings: list[Reading]
    end: np.ndarray[Any, Any]
    tolerance: float


def load(folder: Path, number: int) -> Recording:
    """One of the two bags with its settings."""
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
    turning = variance[5] if axes[11] else FASTEST_TURN**2  # left out: known as little as can be
    twist = message.twist.twist
    slide = float(max(variance[1], variance[2]))
    return WheelTwist(
        _stamp_ns(message),
        float(twist.linear.x),
        float(twist.angular.z),
        float(variance[0]),
        float(turning),
        slide,
    )


def _imu(message: Any, axes: list[bool], mount: np.ndarray[Any, Any]) -> ImuReading:
    def turned(v: Any) -> tuple[float, float, float]:
        x, y, z = (mount @ np.array([v.x, v.y, v.z])).tolist()
        return x, y, z

    def told(covariance: Any, chosen: list[bool]) -> tuple[float, float, float]:
        variances = (mount @ covariance.reshape(3, 3) @ mount.T).diagonal()
        a, b, c = (float(v) if on else math.inf for v, on in zip(variances, chosen, strict=True))
        return a, b, c

    return ImuReading(
        _stamp_ns(message),
        turned(message.angular_velocity),
        told(message.angular_velocity_covariance, axes[9:12]),
        turned(message.linear_acceleration),
        told(message.linear_acceleration_covariance, axes[12:15]),
        _attitude(message.orientation, mount),
        told(message.orientation_covariance, axes[3:6]),
    )


def _attitude(q: Any, mount: np.ndarray[Any, Any]) -> tuple[float, float, float]:
    """Roll, pitch, yaw of base_link: the IMU's axes in the world, turned back by its mount."""
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
