"""Constraints on the content of messages, such as ranges of numbers and consistent array sizes.

RULES lists the constraints of each type; `validity.check` applies them to a message and all nested messages.
They are as strict as the meaning of a type allows and no stricter: real drivers may be off by one beam, and
leave fields unset.
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
"""Returns what is wrong with a message, beginning with the field's name, or '' if it is valid."""

MAX_MAGNITUDE = 1e6
"""Upper bound for positions, speeds and accelerations of an indoor robot, SI units."""
QUATERNION_TOLERANCE = 1e-2
"""Tolerance of the squared norm; as in tf2::BufferCore::setTransform and nav2_util::validateMsg."""
MAX_BEAMS = 100_000
MAX_CELLS = 100_000_000
"""Maximum number of cells of a map, the same as for a map file."""
MIN_RESOLUTION, MAX_RESOLUTION = 1e-3, 100.0
"""Bounds of a map's resolution, m per cell; inflation of a finer map would take too long."""
MAX_MAP_AREA = 500_000.0
"""Maximum area of a map, m^2: localization keeps a likelihood field of it."""
MAX_PATH_LENGTH = 10_000.0
"""Maximum length of a path, m; a controller samples it every centimetre."""
MAX_POSES = 100_000
MAX_PIXELS = 20_000_000
MAX_TICKS = 2**53
"""Maximum tick count: above it a double cannot represent every integer."""
SPAN_TOLERANCE = 0.05
"""Relative tolerance between a scan's angles and its number of beams; at least 3 beams."""
CORRELATION_TOLERANCE = 1e-6
BYTES_PER_PIXEL = {
    **dict.fromkeys(("mono8", "8UC1"), 1),
    **dict.fromkeys(("16UC1", "mono16"), 2),
    **dict.fromkeys(("rgb8", "bgr8", "8UC3"), 3),
    **dict.fromkeys(("rgba8", "bgra8", "8UC4", "32FC1"), 4),
}
"""Bytes per pixel of the supported encodings (sensor_msgs/image_encodings.hpp)."""


def within(low: float, high: float, *names: str) -> Rule:
    """Require that these fields lie between the bounds, both included; NaN does not."""

    def check(message: Message) -> str:
        for name in names:
            value = getattr(message, name)
            if not low <= value <= high:
                return f"{name} is {value:.6g}, it must lie between {low:g} and {high:g}"
        return ""

    return check


def ordered(low: str, high: str) -> Rule:
    """Require that the first field is not greater than the second."""

    def check(message: Message) -> str:
        a, b = getattr(message, low), getattr(message, high)
        return "" if a <= b else f"{low} is {a:.6g}, above {high}, which is {b:.6g}"

    return check


def same_length(name: str, *others: str, may_be_empty: bool = False) -> Rule:
    """Require that the other arrays have as many elements as the first.

    `may_be_empty`: an array may also be empty, which means "not measured".
    """

    def check(message: Message) -> str:
        size = len(getattr(message, name))
        for other in others:
            n = len(getattr(message, other))
            if n != size and not (may_be_empty and n == 0):
                return f"{other} has {n} elements, {name} has {size}"
        return ""

    return check


def max_length(limit: int, *names: str) -> Rule:
    """Require that these arrays have at most so many elements."""

    def check(message: Message) -> str:
        for name in names:
            n = len(getattr(message, name))
            if n > limit:
                return f"{name} has {n} elements, at most {limit} can be used"
        return ""

    return check


def covariance(name: str, side: int, *, may_be_unknown: bool = False) -> Rule:
    """Require variances >= 0, and covariances within the Cauchy-Schwarz bound.

    `may_be_unknown`: a first element of -1 means that the quantity is not measured (sensor_msgs/Imu).
    """

    def check(message: Message) -> str:
        matrix: NDArray[np.float64] = getattr(message, name).reshape(side, side)
        if may_be_unknown and matrix[0, 0] == -1.0:
            return ""
        variances = matrix.diagonal()
        if (variances < 0.0).any():
            return f"{name} holds the variance {variances.min():.6g}, which is below 0"
        # Cauchy-Schwarz: |cov(i, j)| <= sigma_i sigma_j
        sigma = np.sqrt(variances) * (1.0 + CORRELATION_TOLERANCE)
        if (np.abs(matrix) > np.outer(sigma, sigma)).any():
            return f"{name} holds a covariance that is larger than its variances allow"
        return ""

    return check


def unit_quaternion(q: Quaternion) -> str:
    """Require that the quaternion has unit norm and thus is a rotation."""
    if max(abs(q.x), abs(q.y), abs(q.z), abs(q.w)) > 2.0:
        return f"x, y, z, w are {q.x:.3g}, {q.y:.3g}, {q.z:.3g}, {q.w:.3g}: no rotation"
    squared_norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if abs(squared_norm - 1.0) <= QUATERNION_TOLERANCE:
        return ""
    return f"its norm is {math.sqrt(squared_norm):.3g} and not 1"


def at_most_one_turn(scan: LaserScan | ObstacleScan) -> str:
    """Require that the beams span at most one turn, within a tolerance."""
    steps = max(len(scan.ranges) - 1, 0)
    span = abs(scan.angle_increment) * steps
    tolerance = max(3.0, SPAN_TOLERANCE * steps) * abs(scan.angle_increment)
    if steps and scan.angle_increment == 0.0:
        return f"angle_increment is 0, but there are {steps + 1} ranges"
    if span > 2.0 * math.pi + min(tolerance, math.pi):
        return f"angle_increment is {scan.angle_increment:.6g} rad: {steps + 1} ranges span more than a turn"
    return ""


def scan_angles(scan: LaserScan) -> str:
    """Require that the number of ranges agrees with the angles."""
    if not len(scan.ranges):
        return ""
    steps = len(scan.ranges) - 1
    expected_steps = (scan.angle_max - scan.angle_min) / scan.angle_increment if scan.angle_increment else 0.0
    if abs(expected_steps - steps) <= max(3.0, SPAN_TOLERANCE * steps):
        return ""
    return f"ranges has {steps + 1} elements, its angles say {expected_steps + 1.0:.6g}"


def map_cells(grid: OccupancyGrid) -> str:
    """Require that the map's size fits its data and the limits, and that each cell is -1 or 0 to 100."""
    info, n = grid.info, len(grid.data)
    if not 0 < info.width * info.height <= MAX_CELLS:
        return f"info: a map of {info.width} x {info.height} cells cannot be used"
    area = info.width * info.height * info.resolution**2
    if area > MAX_MAP_AREA:
        return f"info: the map covers {area:.6g} square metres, at most {MAX_MAP_AREA:g} can be used"
    if n != info.width * info.height:
        return f"data has {n} cells, but the map has {info.width} x {info.height}"
    if grid.data.min() < -1 or grid.data.max() > 100:
        return "data holds cells that are neither -1 (unknown) nor 0 to 100 percent"
    return ""


def image_size(image: Image) -> str:
    """Require that the data's size agrees with height and step, and that a row holds its pixels."""
    if image.height * image.width > MAX_PIXELS:
        return f"an image of {image.width} x {image.height} pixels is too large"
    n = image.height * image.step
    if len(image.data) != n:
        return f"data has {len(image.data)} bytes, {image.height} rows of {image.step} have {n}"
    min_step = image.width * BYTES_PER_PIXEL.get(image.encoding, 0)
    if image.step >= min_step:
        return ""
    return f"step is {image.step}, {image.width} pixels of {image.encoding} need {min_step}"


def cloud_size(cloud: PointCloud2) -> str:
    """Require that the data's size agrees with height, width and steps."""
    if cloud.row_step < cloud.width * cloud.point_step:
        return f"row_step is {cloud.row_step}, {cloud.width} points of {cloud.point_step} bytes need more"
    n = cloud.height * cloud.row_step
    return "" if len(cloud.data) == n else f"data has {len(cloud.data)} bytes, its sizes say {n}"


def distinct_frames(transform: TransformStamped) -> str:
    """Require that the transform joins two different frames with names."""
    parent, child = transform.header.frame_id, transform.child_frame_id
    return "" if parent and child and parent != child else f"it joins the frames {parent!r} and {child!r}"


def path_length(path: Path) -> str:
    """Require that the path is not longer than MAX_PATH_LENGTH."""
    points = np.array([(p.pose.position.x, p.pose.position.y) for p in path.poses]).reshape(-1, 2)
    length = float(np.hypot(*np.diff(points, axis=0).T).sum())
    if length > MAX_PATH_LENGTH:
        return f"poses lead over {length:.6g} m, at most {MAX_PATH_LENGTH:g} can be driven"
    return ""


RULES: dict[type[Message], tuple[Rule, ...]] = {
    Time: (within(0, math.inf, "sec"), within(0, 999_999_999, "nanosec")),
    Duration: (within(0, 999_999_999, "nanosec"),),
    Point: (within(-MAX_MAGNITUDE, MAX_MAGNITUDE, "x", "y", "z"),),
    Point32: (within(-MAX_MAGNITUDE, MAX_MAGNITUDE, "x", "y", "z"),),
    Vector3: (within(-MAX_MAGNITUDE, MAX_MAGNITUDE, "x", "y", "z"),),
    Quaternion: (unit_quaternion,),
    PoseWithCovariance: (covariance("covariance", 6),),
    TwistWithCovariance: (covariance("covariance", 6),),
    TransformStamped: (distinct_frames,),
    Imu: (
        covariance("orientation_covariance", 3, may_be_unknown=True),
        covariance("angular_velocity_covariance", 3, may_be_unknown=True),
        covariance("linear_acceleration_covariance", 3, may_be_unknown=True),
    ),
    LaserScan: (
        max_length(MAX_BEAMS, "ranges"),
        within(-4.0 * math.pi, 4.0 * math.pi, "angle_min", "angle_max"),
        within(0.0, MAX_MAGNITUDE, "range_min", "range_max"),
        ordered("range_min", "range_max"),
        at_most_one_turn,
        scan_angles,
    ),
    ObstacleScan: (
        max_length(MAX_BEAMS, "ranges"),
        within(-4.0 * math.pi, 4.0 * math.pi, "angle_min"),
        within(0.0, MAX_MAGNITUDE, "range_max"),
        at_most_one_turn,
        same_length("ranges", "clear_from", "clear_to"),
        same_length("ranges", "bottom", "top", may_be_empty=True),
    ),
    Range: (ordered("min_range", "max_range"),),
    Image: (image_size,),
    PointCloud2: (cloud_size,),
    JointState: (same_length("name", "position", "velocity", "effort", may_be_empty=True),),
    MapMetaData: (within(MIN_RESOLUTION, MAX_RESOLUTION, "resolution"),),
    OccupancyGrid: (map_cells,),
    Path: (max_length(MAX_POSES, "poses"), path_length),
    WheelTicks: (within(-MAX_TICKS, MAX_TICKS, "left", "right"),),
}
