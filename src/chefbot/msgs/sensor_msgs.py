"""sensor_msgs: measurements of sensors, and joint states."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.geometry_msgs import Quaternion, Vector3
from chefbot.msgs.idl.constraints import MAX_MAGNITUDE, Bounds, covariance, ordered, per_field, same_length
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.message import (
    Bool,
    Float32,
    Float32Array,
    Float64Array,
    Message,
    String,
    StringArray,
    Uint8,
    Uint8Array,
    Uint32,
)  # fmt: skip
from chefbot.msgs.std_msgs import Header

Covariance3 = Annotated[NDArray[np.float64], "float64[9]"]
Matrix33 = Annotated[NDArray[np.float64], "float64[9]"]
Matrix34 = Annotated[NDArray[np.float64], "float64[12]"]
UNKNOWN_COVARIANCE = np.array([-1.0, 0, 0, 0, 0, 0, 0, 0, 0])
"""Covariance of a quantity that is not measured: its first element is -1 (sensor_msgs/Imu)."""
UNKNOWN_COVARIANCE.flags.writeable = False
MAX_BEAMS = 100_000
MAX_PIXELS = 20_000_000
MAX_BYTES = 100_000_000
"""Maximum size of an image or a point cloud, bytes."""
SPAN_TOLERANCE = 0.05
"""Relative tolerance between a scan's angles and its number of beams; at least 3 beams."""
BYTES_PER_PIXEL = {
    **dict.fromkeys(("mono8", "8UC1"), 1),
    **dict.fromkeys(("16UC1", "mono16"), 2),
    **dict.fromkeys(("rgb8", "bgr8", "8UC3"), 3),
    **dict.fromkeys(("rgba8", "bgra8", "8UC4", "32FC1"), 4),
}
"""Bytes per pixel of the supported encodings (sensor_msgs/image_encodings.hpp)."""
BEAM_ANGLE: Bounds = (-4.0 * math.pi, 4.0 * math.pi)
"""Bounds of the angle of a beam, rad."""
DISTANCE: Bounds = (0.0, MAX_MAGNITUDE)
"""Bounds of a distance, m."""
_ZERO_9 = np.zeros(9)
_NO_FLOATS = np.empty(0, np.float32)
_NO_DOUBLES = np.empty(0, np.float64)
_NO_BYTES = np.empty(0, np.uint8)
_PIXEL_FORMATS: dict[str, tuple[type[np.generic], tuple[int, ...]]] = {
    "32FC1": (np.float32, ()),
    "16UC1": (np.uint16, ()),
    "rgb8": (np.uint8, (3,)),
    "bgr8": (np.uint8, (3,)),
    "mono8": (np.uint8, ()),
}
"""Supported image encodings: numpy type of a channel, and shape of a pixel."""
_NO_BUTTONS = np.empty(0, np.int32)
Int32Array = Annotated[NDArray[np.int32], "int32[]"]


def at_most_one_turn(scan: Any) -> str:
    """Require that the beams span at most one turn, within a tolerance."""
    steps = max(len(scan.ranges) - 1, 0)
    span = abs(scan.angle_increment) * steps
    tolerance = max(3.0, SPAN_TOLERANCE * steps) * abs(scan.angle_increment)
    if steps and scan.angle_increment == 0.0:
        return f"angle_increment is 0, but there are {steps + 1} ranges"
    if span > 2.0 * math.pi + min(tolerance, math.pi):
        return f"angle_increment is {scan.angle_increment:.6g} rad: {steps + 1} ranges span more than a turn"
    return ""


def scan_angles(scan: Any) -> str:
    """Require that the number of ranges agrees with the angles."""
    if not len(scan.ranges):
        return ""
    steps = len(scan.ranges) - 1
    expected_steps = (scan.angle_max - scan.angle_min) / scan.angle_increment if scan.angle_increment else 0.0
    if abs(expected_steps - steps) <= max(3.0, SPAN_TOLERANCE * steps):
        return ""
    return f"ranges has {steps + 1} elements, its angles say {expected_steps + 1.0:.6g}"


def image_size(image: Any) -> str:
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


def cloud_size(cloud: Any) -> str:
    """Require that the data's size agrees with height, width and steps."""
    if cloud.row_step < cloud.width * cloud.point_step:
        return f"row_step is {cloud.row_step}, {cloud.width} points of {cloud.point_step} bytes need more"
    n = cloud.height * cloud.row_step
    return "" if len(cloud.data) == n else f"data has {len(cloud.data)} bytes, its sizes say {n}"


class Imu(Message, frozen=True, eq=False):
    """Orientation, angular velocity in rad/s and linear acceleration in m/s^2, with covariances."""

    RULES = (
        covariance("orientation_covariance", 3, may_be_unknown=True),
        covariance("angular_velocity_covariance", 3, may_be_unknown=True),
        covariance("linear_acceleration_covariance", 3, may_be_unknown=True),
    )

    header: Header = Header()
    orientation: Quaternion = Quaternion()
    orientation_covariance: Covariance3 = UNKNOWN_COVARIANCE
    angular_velocity: Vector3 = Vector3()
    angular_velocity_covariance: Covariance3 = _ZERO_9
    linear_acceleration: Vector3 = Vector3()
    linear_acceleration_covariance: Covariance3 = _ZERO_9


class LaserScan(Message, frozen=True, eq=False):
    """Ranges in m at equally spaced angles in rad; +inf: nothing in range, NaN: no measurement (REP-117)."""

    BOUNDS = per_field(
        **dict.fromkeys(("angle_min", "angle_max"), BEAM_ANGLE),
        **dict.fromkeys(("range_min", "range_max"), DISTANCE),
        **dict.fromkeys(("time_increment", "scan_time"), (-3600.0, 3600.0)),
    )
    MAX_LENGTHS = dict.fromkeys(("ranges", "intensities"), MAX_BEAMS)
    RULES = (ordered("range_min", "range_max"), at_most_one_turn, scan_angles)

    header: Header = Header()
    angle_min: Float32 = 0.0
    angle_max: Float32 = 0.0
    angle_increment: Float32 = 0.0
    time_increment: Float32 = 0.0
    scan_time: Float32 = 0.0
    range_min: Float32 = 0.0
    range_max: Float32 = 0.0
    ranges: Float32Array = _NO_FLOATS
    intensities: Float32Array = _NO_FLOATS

    @property
    def angles(self) -> NDArray[np.float32]:
        """Angle of each range in the sensor frame, rad, shape (n,)."""
        steps = np.arange(len(self.ranges), dtype=np.float64)
        return (self.angle_min + steps * self.angle_increment).astype(np.float32)


class Image(Message, frozen=True, eq=False):
    """An uncompressed image, row-major from the top."""

    MAX_LENGTHS = per_field(data=MAX_BYTES)
    RULES = (image_size,)

    header: Header = Header()
    height: Uint32 = 0
    width: Uint32 = 0
    encoding: String = ""
    is_bigendian: Uint8 = 0
    step: Uint32 = 0
    data: Uint8Array = _NO_BYTES

    @property
    def pixels(self) -> NDArray[np.generic]:
        """Pixels: (height, width) in m for 32FC1, in mm for 16UC1, for mono8; (height, width, 3) for rgb8 and bgr8.

        InvalidMessageError for another encoding or an image without pixels.
        """
        if self.encoding not in _PIXEL_FORMATS or not (self.height and self.width):
            raise InvalidMessageError(
                f"an image of {self.width} x {self.height} pixels of encoding {self.encoding[:20]!r} cannot be used;"
                f" there are {', '.join(_PIXEL_FORMATS)}"
            )
        dtype, shape = _PIXEL_FORMATS[self.encoding]
        row_bytes = self.width * np.dtype(dtype).itemsize * math.prod(shape)  # without padding
        rows = np.ascontiguousarray(self.data.reshape(self.height, self.step)[:, :row_bytes])
        return rows.view(dtype).reshape(self.height, self.width, *shape)

    @staticmethod
    def of(header: Header, encoding: str, pixels: NDArray[np.generic]) -> Image:
        """Create an image from an array whose type fits the encoding."""
        flat = np.ascontiguousarray(pixels).reshape(-1).view(np.uint8)
        height, width = pixels.shape[:2]
        return Image(header, height, width, encoding, 0, len(flat) // height, flat)


class CompressedImage(Message, frozen=True, eq=False):
    """An image in JPEG or PNG format."""

    MAX_LENGTHS = per_field(data=MAX_BYTES)

    header: Header = Header()
    format: String = ""
    data: Uint8Array = _NO_BYTES


class RegionOfInterest(Message, frozen=True, eq=False):
    """A part of an image, pixels; all zero for the whole image."""

    x_offset: Uint32 = 0
    y_offset: Uint32 = 0
    height: Uint32 = 0
    width: Uint32 = 0
    do_rectify: Bool = False


class CameraInfo(Message, frozen=True, eq=False):
    """The calibration of a camera: intrinsics and distortion, pixels."""

    header: Header = Header()
    height: Uint32 = 0
    width: Uint32 = 0
    distortion_model: String = "plumb_bob"
    d: Float64Array = _NO_DOUBLES
    k: Matrix33 = _ZERO_9
    r: Matrix33 = _ZERO_9
    p: Matrix34 = np.zeros(12)
    binning_x: Uint32 = 0
    binning_y: Uint32 = 0
    roi: RegionOfInterest = RegionOfInterest()


class Range(Message, frozen=True, eq=False):
    """A single range reading of a sensor with a conical field of view, m."""

    BOUNDS = per_field(
        field_of_view=(0.0, 2.0 * math.pi),
        **dict.fromkeys(("min_range", "max_range", "range"), (-MAX_MAGNITUDE, MAX_MAGNITUDE)),
        variance=(0.0, MAX_MAGNITUDE),
    )
    RULES = (ordered("min_range", "max_range"),)

    ULTRASOUND = 0
    INFRARED = 1

    header: Header = Header()
    radiation_type: Uint8 = 0
    field_of_view: Float32 = 0.0
    min_range: Float32 = 0.0
    max_range: Float32 = 0.0
    range: Float32 = 0.0
    variance: Float32 = 0.0


class BatteryState(Message, frozen=True, eq=False):
    """The state of the battery in V, A, degC and Ah; NaN where not measured."""

    BOUNDS = per_field(
        **dict.fromkeys(("voltage", "current"), (-1000.0, 1000.0)),
        temperature=(-273.15, 1000.0),
        **dict.fromkeys(("charge", "capacity", "design_capacity"), (-1e6, 1e6)),
        percentage=(-1.0, 100.0),
    )

    header: Header = Header()
    voltage: Float32 = 0.0
    temperature: Float32 = float("nan")
    current: Float32 = float("nan")
    charge: Float32 = float("nan")
    capacity: Float32 = float("nan")
    design_capacity: Float32 = float("nan")
    percentage: Float32 = float("nan")
    power_supply_status: Uint8 = 0
    power_supply_health: Uint8 = 0
    power_supply_technology: Uint8 = 0
    present: Bool = True
    cell_voltage: Float32Array = _NO_FLOATS
    cell_temperature: Float32Array = _NO_FLOATS
    location: String = ""
    serial_number: String = ""


class JointState(Message, frozen=True, eq=False):
    """Positions, rad, velocities, rad/s, and efforts, N m, of joints."""

    RULES = (same_length("name", "position", "velocity", "effort", may_be_empty=True),)

    header: Header = Header()
    name: StringArray = ()
    position: Float64Array = _NO_DOUBLES
    velocity: Float64Array = _NO_DOUBLES
    effort: Float64Array = _NO_DOUBLES


class PointField(Message, frozen=True, eq=False):
    """The layout of one field within the bytes of a point."""

    name: String = ""
    offset: Uint32 = 0
    datatype: Uint8 = 0
    count: Uint32 = 0


class PointCloud2(Message, frozen=True, eq=False):
    """A point cloud as binary data, whose layout `fields` describes."""

    MAX_LENGTHS = per_field(data=MAX_BYTES)
    RULES = (cloud_size,)

    header: Header = Header()
    height: Uint32 = 0
    width: Uint32 = 0
    fields: tuple[PointField, ...] = ()
    is_bigendian: Bool = False
    point_step: Uint32 = 0
    row_step: Uint32 = 0
    data: Uint8Array = _NO_BYTES
    is_dense: Bool = False


class Joy(Message, frozen=True, eq=False):
    """The axes, from -1 to 1, and buttons of a gamepad."""

    header: Header = Header()
    axes: Float32Array = _NO_FLOATS
    buttons: Int32Array = _NO_BUTTONS
