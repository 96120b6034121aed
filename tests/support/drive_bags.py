"""Bags with the scans, odometry and transforms of a drive, in every format, written by the library rosbags."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from chefbot.maths.se2 import SE2

FORMATS = ("mcap", "sqlite", "ros1")
Turn = tuple[float, float, float, float]
LEVEL: Turn = (0.0, 0.0, 0.0, 1.0)
UPSIDE_DOWN: Turn = (1.0, 0.0, 0.0, 0.0)


class DriveBag:
    """A bag that is being written; the time of every message is the stamp in its header."""

    def __init__(self, folder: Path, kind: str) -> None:
        self._ros1 = kind == "ros1"
        self.path = folder / ("drive.bag" if self._ros1 else f"drive_{kind}")
        self._types = get_typestore(Stores.ROS1_NOETIC if self._ros1 else Stores.ROS2_HUMBLE)
        if self._ros1:
            transforms = "geometry_msgs/TransformStamped[] transforms"
            self._types.register(get_types_from_msg(transforms, "tf2_msgs/msg/TFMessage"))
            self._writer: Any = Ros1Writer(self.path)
        else:
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            self._writer = Ros2Writer(self.path, version=8, storage_plugin=plugin)
        self._connections: dict[str, Any] = {}
        self._writer.open()

    def close(self) -> Path:
        self._writer.close()
        return self.path

    def odometry(self, stamp_ns: int, pose: SE2, topic: str = "/odom") -> None:
        at = self._new("geometry_msgs/msg/Point", x=pose.x, y=pose.y, z=0.0)
        turned = self._quaternion((0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)))
        still = self._new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        message = self._new(
            "nav_msgs/msg/Odometry",
            header=self._header(stamp_ns, "odom"),
            child_frame_id="base_link",
            pose=self._with_covariance(
                "Pose", self._new("geometry_msgs/msg/Pose", position=at, orientation=turned)
            ),
            twist=self._with_covariance(
                "Twist", self._new("geometry_msgs/msg/Twist", linear=still, angular=still)
            ),
        )
        self._write(topic, "nav_msgs/msg/Odometry", message, stamp_ns)

    def transform(
        self,
        stamp_ns: int,
        parent: str,
        child: str,
        place: Sequence[float],
        turn: Turn,
        topic: str = "/tf_static",
    ) -> None:
        x, y, z = place
        value = self._new(
            "geometry_msgs/msg/Transform",
            translation=self._new("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
            rotation=self._quaternion(turn),
        )
        stamped = self._new(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(stamp_ns, parent),
            child_frame_id=child,
            transform=value,
        )
        message = self._new("tf2_msgs/msg/TFMessage", transforms=[stamped])
        self._write(topic, "tf2_msgs/msg/TFMessage", message, stamp_ns)

    def scan(
        self,
        stamp_ns: int,
        angles: tuple[float, float],
        ranges: np.ndarray,
        topic: str = "/scan",
        sweep: float = 0.0,
        recorded_ns: int = 0,
    ) -> None:
        message = self._new(
            "sensor_msgs/msg/LaserScan",
            header=self._header(stamp_ns, "laser"),
            angle_min=angles[0],
            angle_max=angles[1],
            angle_increment=(angles[1] - angles[0]) / max(len(ranges) - 1, 1),
            time_increment=sweep / max(len(ranges) - 1, 1),
            scan_time=0.1,
            range_min=0.1,
            range_max=10.0,
            ranges=ranges.astype(np.float32),
            intensities=np.zeros(0, np.float32),
        )
        self._write(topic, "sensor_msgs/msg/LaserScan", message, recorded_ns or stamp_ns)

    def _new(self, kind: str, **fields: Any) -> Any:
        return self._types.types[kind](**fields)

    def _quaternion(self, value: Turn) -> Any:
        return self._new("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", value, strict=True)))

    def _with_covariance(self, kind: str, value: Any) -> Any:
        return self._new(
            f"geometry_msgs/msg/{kind}WithCovariance", **{kind.lower(): value}, covariance=np.zeros(36)
        )

    def _header(self, stamp_ns: int, frame: str) -> Any:
        stamp = self._new("builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        number = {"seq": 0} if self._ros1 else {}
        return self._new("std_msgs/msg/Header", **number, stamp=stamp, frame_id=frame)

    def _write(self, topic: str, kind: str, message: Any, stamp_ns: int) -> None:
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, kind, typestore=self._types)
        serialize = self._types.serialize_ros1 if self._ros1 else self._types.serialize_cdr
        self._writer.write(self._connections[topic], stamp_ns, serialize(message, kind))


def straight_drive() -> Iterator[tuple[int, SE2]]:
    """Yield stamps, ns, and poses of a robot that drives 1 m/s forward while it turns slowly, 50 times a second."""
    for k in range(101):
        yield 10**12 + 20_000_000 * k, SE2(0.02 * k, 0.1, 0.004 * k)
