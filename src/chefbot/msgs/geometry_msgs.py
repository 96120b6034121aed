"""geometry_msgs: points, poses, twists, transforms."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.msgs.idl.constraints import MAX_MAGNITUDE, Bounds, covariance
from chefbot.msgs.idl.message import Float32, Float64, Message, String
from chefbot.msgs.std_msgs import Header

Covariance = Annotated[NDArray[np.float64], "float64[36]"]
POSITION: dict[str, Bounds] = dict.fromkeys(("x", "y", "z"), (-MAX_MAGNITUDE, MAX_MAGNITUDE))
"""Bounds of a position, a speed or an acceleration, SI units."""
QUATERNION_TOLERANCE = 1e-2
"""Tolerance of the squared norm; as in tf2::BufferCore::setTransform and nav2_util::validateMsg."""
_ZERO_36 = np.zeros(36)
_ZERO_36.flags.writeable = False
_PLANAR = np.array([0, 1, 5])  # x, y, yaw among x, y, z, roll, pitch, yaw
_PLANAR_36 = (6 * _PLANAR[:, None] + _PLANAR).reshape(9)  # indices of their covariances among the 36


def unit_quaternion(q: Any) -> str:
    """Require that the quaternion has unit norm and thus is a rotation."""
    if max(abs(q.x), abs(q.y), abs(q.z), abs(q.w)) > 2.0:
        return f"x, y, z, w are {q.x:.3g}, {q.y:.3g}, {q.z:.3g}, {q.w:.3g}: no rotation"
    squared_norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if abs(squared_norm - 1.0) <= QUATERNION_TOLERANCE:
        return ""
    return f"norm is {math.sqrt(squared_norm):.3g} and not 1"


def distinct_frames(transform: Any) -> str:
    """Require that the transform joins two different frames with names."""
    parent, child = transform.header.frame_id, transform.child_frame_id
    if parent and child and parent != child:
        return ""
    return f"header.frame_id and child_frame_id are {parent!r} and {child!r}, not two frames"


class Vector3(Message, frozen=True, eq=False):
    """A vector in free space; not affected by translation."""

    BOUNDS = POSITION

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


class Point(Message, frozen=True, eq=False):
    """A position in space, m."""

    BOUNDS = POSITION

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


class Quaternion(Message, frozen=True, eq=False):
    """An orientation as a unit quaternion."""

    RULES = (unit_quaternion,)

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0
    w: Float64 = 1.0

    @property
    def yaw(self) -> float:
        """Heading about the z axis, rad."""
        return math.atan2(
            2.0 * (self.w * self.z + self.x * self.y), 1.0 - 2.0 * (self.y * self.y + self.z * self.z)
        )

    @staticmethod
    def of_yaw(yaw: float) -> Quaternion:
        """Create a rotation by `yaw` rad about the z axis."""
        return Quaternion(0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))


class Pose(Message, frozen=True, eq=False):
    """A position and an orientation."""

    position: Point = Point()
    orientation: Quaternion = Quaternion()

    @property
    def se2(self) -> SE2:
        """The pose projected onto the ground plane."""
        return SE2(self.position.x, self.position.y, self.orientation.yaw)

    @staticmethod
    def of(pose: SE2) -> Pose:
        """Create a pose on the ground plane."""
        return Pose(Point(pose.x, pose.y, 0.0), Quaternion.of_yaw(pose.yaw))


class PoseStamped(Message, frozen=True, eq=False):
    """A pose with its frame and time."""

    header: Header = Header()
    pose: Pose = Pose()


class PoseArray(Message, frozen=True, eq=False):
    """Several poses in one frame."""

    header: Header = Header()
    poses: tuple[Pose, ...] = ()


class PoseWithCovariance(Message, frozen=True, eq=False):
    """A pose with its covariance, row-major over x, y, z, roll, pitch, yaw."""

    RULES = (covariance("covariance", 6),)

    pose: Pose = Pose()
    covariance: Covariance = _ZERO_36

    @property
    def planar_covariance(self) -> NDArray[np.float64]:
        """Covariance of x, y, yaw, shape (3, 3)."""
        return self.covariance[_PLANAR_36].reshape(3, 3)


class PoseWithCovarianceStamped(Message, frozen=True, eq=False):
    """A pose and its covariance with frame and time."""

    header: Header = Header()
    pose: PoseWithCovariance = PoseWithCovariance()


class Twist(Message, frozen=True, eq=False):
    """Linear velocity in m/s and angular velocity in rad/s."""

    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()

    @staticmethod
    def of(v: float, w: float) -> Twist:
        """Create a planar twist from forward speed `v`, m/s, and turn rate `w`, rad/s."""
        return Twist(Vector3(v, 0.0, 0.0), Vector3(0.0, 0.0, w))


class TwistStamped(Message, frozen=True, eq=False):
    """A twist with its frame and time."""

    header: Header = Header()
    twist: Twist = Twist()


class TwistWithCovariance(Message, frozen=True, eq=False):
    """A twist with its covariance, row-major over linear x, y, z and angular x, y, z."""

    RULES = (covariance("covariance", 6),)

    twist: Twist = Twist()
    covariance: Covariance = _ZERO_36


class Transform(Message, frozen=True, eq=False):
    """A transform from a child frame to its parent frame."""

    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()

    @property
    def se2(self) -> SE2:
        """The transform projected onto the ground plane."""
        return SE2(self.translation.x, self.translation.y, self.rotation.yaw)


class TransformStamped(Message, frozen=True, eq=False):
    """A transform with its parent frame, child frame and time."""

    RULES = (distinct_frames,)

    header: Header = Header()
    child_frame_id: String = ""
    transform: Transform = Transform()

    @staticmethod
    def of(ns: int, parent: str, child: str, pose: SE2, z: float = 0.0) -> TransformStamped:
        """Create `parent_T_child` in the ground plane, or `z` metres above it."""
        transform = Transform(Vector3(pose.x, pose.y, z), Quaternion.of_yaw(pose.yaw))
        return TransformStamped(Header.of(ns, parent), child, transform)


class PointStamped(Message, frozen=True, eq=False):
    """A point with its frame and time, as RViz's "Publish Point" tool sends it."""

    header: Header = Header()
    point: Point = Point()


class Point32(Message, frozen=True, eq=False):
    """A point in single precision, m."""

    BOUNDS = POSITION

    x: Float32 = 0.0
    y: Float32 = 0.0
    z: Float32 = 0.0


class Polygon(Message, frozen=True, eq=False):
    """The corners of a polygon in order."""

    points: tuple[Point32, ...] = ()


class PolygonStamped(Message, frozen=True, eq=False):
    """A polygon in a frame, such as a robot's footprint."""

    header: Header = Header()
    polygon: Polygon = Polygon()


class TwistWithCovarianceStamped(Message, frozen=True, eq=False):
    """A twist and its covariance with frame and time."""

    header: Header = Header()
    twist: TwistWithCovariance = TwistWithCovariance()


def covariance_36(planar: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a planar covariance of x, y, yaw, shape (3, 3), as ROS's row-major 6x6 array, shape (36,).

    The elements of z, roll and pitch are zero.
    """
    full = np.zeros(36)
    full[_PLANAR_36] = planar.reshape(9)
    return full
