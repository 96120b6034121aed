"""geometry_msgs: points, poses, twists, transforms."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.idl.message import Float32, Float64, Message, String
from chefbot.msgs.std_msgs import Header

Covariance = Annotated[NDArray[np.float64], "float64[36]"]
_ZERO_36 = np.zeros(36)
_ZERO_36.flags.writeable = False
_PLANAR = np.array([0, 1, 5])  # x, y, yaw among x, y, z, roll, pitch, yaw
_PLANAR_36 = (6 * _PLANAR[:, None] + _PLANAR).reshape(9)  # their nine places among the 36


class Vector3(Message, frozen=True, eq=False):
    """A direction with length."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


class Point(Message, frozen=True, eq=False):
    """A place."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


class Quaternion(Message, frozen=True, eq=False):
    """A rotation."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0
    w: Float64 = 1.0

    @property
    def yaw(self) -> float:
        """Heading, rad."""
        return math.atan2(
            2.0 * (self.w * self.z + self.x * self.y), 1.0 - 2.0 * (self.y * self.y + self.z * self.z)
        )

    @staticmethod
    def of_yaw(yaw: float) -> Quaternion:
        """A turn about z."""
        return Quaternion(0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))


class Pose(Message, frozen=True, eq=False):
    """Place and attitude."""

    position: Point = Point()
    orientation: Quaternion = Quaternion()

    @property
    def se2(self) -> SE2:
        """Seen from above."""
        return SE2(self.position.x, self.position.y, self.orientation.yaw)

    @staticmethod
    def of(pose: SE2) -> Pose:
        """On the floor."""
        return Pose(Point(pose.x, pose.y, 0.0), Quaternion.of_yaw(pose.yaw))


class PoseStamped(Message, frozen=True, eq=False):
    """A pose in a frame."""

    header: Header = Header()
    pose: Pose = Pose()


class PoseArray(Message, frozen=True, eq=False):
    """Many poses in a frame."""

    header: Header = Header()
    poses: tuple[Pose, ...] = ()


class PoseWithCovariance(Message, frozen=True, eq=False):
    """A pose and how sure of it; rows and columns x, y, z, roll, pitch, yaw."""

    pose: Pose = Pose()
    covariance: Covariance = _ZERO_36

    @property
    def planar_covariance(self) -> NDArray[np.float64]:
        """(3, 3) of x, y, yaw."""
        return self.covariance[_PLANAR_36].reshape(3, 3)


class PoseWithCovarianceStamped(Message, frozen=True, eq=False):
    """A pose with covariance in a frame."""

    header: Header = Header()
    pose: PoseWithCovariance = PoseWithCovariance()


class Twist(Message, frozen=True, eq=False):
    """Velocity: m/s and rad/s."""

    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()

    @staticmethod
    def of(v: float, w: float) -> Twist:
        """Forward speed and turn rate of a robot on the floor."""
        return Twist(Vector3(v, 0.0, 0.0), Vector3(0.0, 0.0, w))


class TwistStamped(Message, frozen=True, eq=False):
    """Velocity of a frame, at a time."""

    header: Header = Header()
    twist: Twist = Twist()


class TwistWithCovariance(Message, frozen=True, eq=False):
    """Velocity and how sure of it."""

    twist: Twist = Twist()
    covariance: Covariance = _ZERO_36


class Transform(Message, frozen=True, eq=False):
    """A child frame seen from its parent."""

    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()

    @property
    def se2(self) -> SE2:
        """Seen from above."""
        return SE2(self.translation.x, self.translation.y, self.rotation.yaw)


class TransformStamped(Message, frozen=True, eq=False):
    """A transform with its two frames and time."""

    header: Header = Header()
    child_frame_id: String = ""
    transform: Transform = Transform()

    @staticmethod
    def of(ns: int, parent: str, child: str, pose: SE2, z: float = 0.0) -> TransformStamped:
        """`parent_T_child` on the floor, or `z` metres above it."""
        transform = Transform(Vector3(pose.x, pose.y, z), Quaternion.of_yaw(pose.yaw))
        return TransformStamped(Header.of(ns, parent), child, transform)


class PointStamped(Message, frozen=True, eq=False):
    """A place in a frame; RViz's button "Publish Point" gives it."""

    header: Header = Header()
    point: Point = Point()


class Point32(Message, frozen=True, eq=False):
    """A place of single precision."""

    x: Float32 = 0.0
    y: Float32 = 0.0
    z: Float32 = 0.0


class Polygon(Message, frozen=True, eq=False):
    """Corners in order."""

    points: tuple[Point32, ...] = ()


class PolygonStamped(Message, frozen=True, eq=False):
    """Corners in a frame, such as a robot's outline."""

    header: Header = Header()
    polygon: Polygon = Polygon()


class TwistWithCovarianceStamped(Message, frozen=True, eq=False):
    """Velocity with covariance of a frame, at a time."""

    header: Header = Header()
    twist: TwistWithCovariance = TwistWithCovariance()


def covariance_36(planar: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) of x, y, yaw as ROS wants it: (36,) with zeros for what a robot on the floor cannot do."""
    full = np.zeros(36)
    full[_PLANAR_36] = planar.reshape(9)
    return full
