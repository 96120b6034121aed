"""What a message of each type has to keep, so that a robot can work with it: limits of numbers, sizes that agree.

RULES names the constraints of each type; `validity.check` applies them to a message and all that it holds. They are
as strict as the meaning of a type allows and no stricter: real drivers are a beam off, and may leave fields unset.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.builtin_interfaces import Duration, Time
from chefbot.msgs.chefbot_msgs import ObstacleScan, WheelTicks
from chefbot.msgs.geometry_msgs import (
    Point,
    Point32,
    PoseWithCovariance,
    Quaternion,
    TransformStamped,
    TwistWithCovariance,
    Vector3,
)
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import MapMetaData, OccupancyGrid, Path
from chefbot.msgs.sensor_msgs import Image, Imu, JointState, LaserScan, PointCloud2, Range

Rule = Callable[[Any], str]
"""Of a message: what is wrong with it, beginning with the field's name; '' if nothing is."""

FARTHEST = 1e6
"""Metres, metres per second and the like: no place, speed or acceleration of a robot indoors is beyond."""
QUATERNION_TOLERANCE = 1e-2
"""By which the squared norm may differ from 1; as in tf2::BufferCore::setTransform and nav2_util::validateMsg."""
MOST_BEAMS = 100_000
MOST_CELLS = 100_000_000
"""Of a map; as many as a map's file may have."""
FINEST_CELL, COARSEST_CELL = 1e-3, 100.0
"""Metres; a finer map could not be inflated in any useful time."""
LARGEST_AREA = 500_000.0
"""Square metres of a map: localization keeps a table of it."""
LONGEST_PATH = 10_000.0
"""Metres; a controller looks at every centimetre."""
MOST_POSES = 100_000
MOST_PIXELS = 20_000_000
MOST_TICKS = 2**53
"""Beyond, neighbouring counts are the same number to a double."""
SPAN_SLACK = 0.05
"""Share of a scan's beams by which its angles may disagree with their number; at least 3 beams may."""
CORRELATION_SLACK = 1e-6
PIXEL_BYTES = {
    **dict.fromkeys(("mono8", "8UC1"), 1),
    **dict.fromkeys(("16UC1", "mono16"), 2),
    **dict.fromkeys(("rgb8", "bgr8", "8UC3"), 3),
    **dict.fromkeys(("rgba8", "bgra8", "8UC4", "32FC1"), 4),
}
"""Of the encodings that are known (sensor_msgs/image_encodings.hpp)."""


def within(low: float, high: float, *names: str) -> Rule:
    """These fields lie between the two, both included; NaN does not."""

    def check(message: Message) -> str:
        for name in names:
            value = getattr(message, name)
            if not low <= value <= high:
                return f"{name} is {value:.6g}, it must lie between {low:g} and {high:g}"
        return ""

    return check


def all_within(low: float, high: float, *names: str) -> Rule:
    """So do all elements of these arrays."""

    def check(message: Message) -> str:
        for name in names:
            values = getattr(message, name)
            if not bool(np.all((values >= low) & (values <= high))):
                return f"{name} holds a number that does not lie between {low:g} and {high:g}"
        return ""

    return check


def in_order(low: str, high: str) -> Rule:
    """The first field is not above the second."""

    def check(message: Message) -> str:
        a, b = getattr(message, low), getattr(message, high)
        return "" if a <= b else f"{low} is {a:.6g}, above {high}, which is {b:.6g}"

    return check


def as_long(name: str, *others: str, may_be_empty: bool = False) -> Rule:
    """The other arrays have as many elements as the first, or none if that says "not measured"."""

    def check(message: Message) -> str:
        size = len(getattr(message, name))
        for other in others:
            n = len(getattr(message, other))
            if n != size and not (may_be_empty and n == 0):
                return f"{other} has {n} elements, {name} has {size}"
        return ""

    return check


def at_most(most: int, *names: str) -> Rule:
    """These arrays have no more elements."""

    def check(message: Message) -> str:
        for name in names:
            n = len(getattr(message, name))
            if n > most:
                return f"{name} has {n} elements, at most {most} can be used"
        return ""

    return check


def covariance(name: str, side: int, *, may_be_unknown: bool = False) -> Rule:
    """No variance is below 0, and no covariance larger than two variances allow (Cauchy-Schwarz).

    `may_be_unknown`: a first element of -1 says that the quantity is not measured (sensor_msgs/Imu).
    """

    def check(message: Message) -> str:
        matrix: NDArray[np.float64] = getattr(message, name).reshape(side, side)
        if may_be_unknown and matrix[0, 0] == -1.0:
            return ""
        variances = matrix.diagonal()
        if (variances < 0.0).any():
            return f"{name} holds the variance {variances.min():.6g}, which is below 0"
        spread = np.sqrt(variances) * (1.0 + CORRELATION_SLACK)
        if (np.abs(matrix) > np.outer(spread, spread)).any():
            return f"{name} holds a covariance that is larger than its variances allow"
        return ""

    return check


def unit_quaternion(q: Quaternion) -> str:
    """It is a rotation."""
    if max(abs(q.x), abs(q.y), abs(q.z), abs(q.w)) > 2.0:
        return f"x, y, z, w are {q.x:.3g}, {q.y:.3g}, {q.z:.3g}, {q.w:.3g}: no rotation"
    squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    return (
        ""
        if abs(squared - 1.0) <= QUATERNION_TOLERANCE
        else f"its norm is {math.sqrt(squared):.3g} and not 1"
    )


def one_turn(scan: LaserScan | ObstacleScan) -> str:
    """The beams lie within one turn."""
    steps = max(len(scan.ranges) - 1, 0)
    span, slack = abs(scan.angle_increment) * steps, max(3.0, SPAN_SLACK * steps) * abs(scan.angle_increment)
    if steps and scan.angle_increment == 0.0:
        return f"angle_increment is 0, but there are {steps + 1} ranges"
    if span > 2.0 * math.pi + min(slack, math.pi):
        return f"angle_increment is {scan.angle_increment:.6g} rad: {steps + 1} ranges span more than a turn"
    return ""


def scan_angles(scan: LaserScan) -> str:
    """There are as many ranges as the angles say."""
    if not len(scan.ranges):
        return ""
    steps = len(scan.ranges) - 1
    told = (scan.angle_max - scan.angle_min) / scan.angle_increment if scan.angle_increment else 0.0
    if abs(told - steps) <= max(3.0, SPAN_SLACK * steps):
        return ""
    return f"ranges has {steps + 1} elements, its angles say {told + 1.0:.6g}"


def map_cells(grid: OccupancyGrid) -> str:
    """As many cells as width and height say, at least one, each unknown or a percentage."""
    info, n = grid.info, len(grid.data)
    if not 0 < info.width * info.height <= MOST_CELLS:
        return f"info: a map of {info.width} x {info.height} cells cannot be used"
    area = info.width * info.height * info.resolution**2
    if area > LARGEST_AREA:
        return f"info: the map covers {area:.6g} square metres, at most {LARGEST_AREA:g} can be used"
    if n != info.width * info.height:
        return f"data has {n} cells, but the map has {info.width} x {info.height}"
    if grid.data.min() < -1 or grid.data.max() > 100:
        return "data holds cells that are neither -1 (unknown) nor 0 to 100 percent"
    return ""


def image_size(image: Image) -> str:
    """As many bytes as rows and step say, and rows that hold their pixels."""
    if image.height * image.width > MOST_PIXELS:
        return f"an image of {image.width} x {image.height} pixels is too large"
    n = image.height * image.step
    if len(image.data) != n:
        return f"data has {len(image.data)} bytes, {image.height} rows of {image.step} have {n}"
    least = image.width * PIXEL_BYTES.get(image.encoding, 0)
    return (
        ""
        if image.step >= least
        else f"step is {image.step}, {image.width} pixels of {image.encoding} need {least}"
    )


def cloud_size(cloud: PointCloud2) -> str:
    """As many bytes as its sizes say."""
    if cloud.row_step < cloud.width * cloud.point_step:
        return f"row_step is {cloud.row_step}, {cloud.width} points of {cloud.point_step} bytes need more"
    n = cloud.height * cloud.row_step
    return "" if len(cloud.data) == n else f"data has {len(cloud.data)} bytes, its sizes say {n}"


def two_frames(transform: TransformStamped) -> str:
    """It joins two different frames that have names."""
    parent, child = transform.header.frame_id, transform.child_frame_id
    return "" if parent and child and parent != child else f"it joins the frames {parent!r} and {child!r}"


def path_length(path: Path) -> str:
    """It can be driven in a day."""
    places = np.array([(one.pose.position.x, one.pose.position.y) for one in path.poses]).reshape(-1, 2)
    length = float(np.hypot(*np.diff(places, axis=0).T).sum())
    return (
        f"poses lead over {length:.6g} m, at most {LONGEST_PATH:g} can be driven"
        if length > LONGEST_PATH
        else ""
    )


RULES: dict[type[Message], tuple[Rule, ...]] = {
    Time: (within(0, math.inf, "sec"), within(0, 999_999_999, "nanosec")),
    Duration: (within(0, 999_999_999, "nanosec"),),
    Point: (within(-FARTHEST, FARTHEST, "x", "y", "z"),),
    Point32: (within(-FARTHEST, FARTHEST, "x", "y", "z"),),
    Vector3: (within(-FARTHEST, FARTHEST, "x", "y", "z"),),
    Quaternion: (unit_quaternion,),
    PoseWithCovariance: (covariance("covariance", 6),),
    TwistWithCovariance: (covariance("covariance", 6),),
    TransformStamped: (two_frames,),
    Imu: (
        covariance("orientation_covariance", 3, may_be_unknown=True),
        covariance("angular_velocity_covariance", 3, may_be_unknown=True),
        covariance("linear_acceleration_covariance", 3, may_be_unknown=True),
    ),
    LaserScan: (
        at_most(MOST_BEAMS, "ranges"),
        within(-4.0 * math.pi, 4.0 * math.pi, "angle_min", "angle_max"),
        within(0.0, FARTHEST, "range_min", "range_max"),
        in_order("range_min", "range_max"),
        one_turn,
        scan_angles,
    ),
    ObstacleScan: (
        at_most(MOST_BEAMS, "ranges"),
        within(-4.0 * math.pi, 4.0 * math.pi, "angle_min"),
        within(0.0, FARTHEST, "range_max"),
        one_turn,
        as_long("ranges", "clear_from", "clear_to"),
        as_long("ranges", "bottom", "top", may_be_empty=True),
    ),
    Range: (in_order("min_range", "max_range"),),
    Image: (image_size,),
    PointCloud2: (cloud_size,),
    JointState: (as_long("name", "position", "velocity", "effort", may_be_empty=True),),
    MapMetaData: (within(FINEST_CELL, COARSEST_CELL, "resolution"),),
    OccupancyGrid: (map_cells,),
    Path: (at_most(MOST_POSES, "poses"), path_length),
    WheelTicks: (within(-MOST_TICKS, MOST_TICKS, "left", "right"),),
}
