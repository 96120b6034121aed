"""Sensor sections of a robot file: IMU, ultrasonic ranger, cliff sensors, cameras and lidar."""

from __future__ import annotations

import math
from typing import Annotated, Literal, NamedTuple

from msgspec import Meta

from chefbot.robot.quantities import (
    Coordinate,
    Count,
    FieldOfView,
    Length,
    Rate,
)
from chefbot.robot.section import Housing, Mount, RobotSection

AUTO = "auto"
"""Serial port of a device that is searched at all ports."""
LIDAR_DRIVERS = (
    *("ld06", "ld19", "stl19p", "stl27l"),
    *("rplidar_a1", "rplidar_a2", "rplidar_a2m12", "rplidar_a3"),
    *("rplidar_c1", "rplidar_s1", "rplidar_s2", "rplidar_s3"),
    *("ydlidar_x2", "ydlidar_x4", "ydlidar_g2", "ydlidar_g4", "ydlidar_tmini"),
)
"""Models of lidars with a driver (chefbot.lidar.models)."""
MAX_IMAGE_PIXELS, MAX_FIELD_OF_VIEW = 4_000_000, 2.6
"""Maximum size of a depth image, and horizontal field of view of its camera, rad: 149 degrees."""
IMU_DRIVERS = ("bno085_rvc", "witmotion", "witmotion_9600")
"""Models of IMUs on a serial line of their own with a driver (chefbot.imu.models)."""
DEPTH_CAMERA_DRIVERS = ("realsense", "oak", "orbbec")
"""Kinds of depth cameras with a driver (chefbot.devices.cameras), and names of the extras that they need."""
COLOR_CAMERA_DRIVERS = ("v4l2",)
"""Kinds of colour cameras with a driver (chefbot.devices.cameras.video_source)."""
TagFamily = Literal["tag16h5", "tag25h9", "tag36h10", "tag36h11"]
"""Families of AprilTags (Olson 2011); the last digits are the number of bits by which two tags differ at least."""
TAG_SQUARES: dict[TagFamily, int] = {"tag16h5": 6, "tag25h9": 7, "tag36h10": 8, "tag36h11": 8}
"""Squares across a tag of each family, with its black border."""
TAG_COUNTS: dict[TagFamily, int] = {"tag16h5": 30, "tag25h9": 35, "tag36h10": 2320, "tag36h11": 587}
"""Number of tags of each family; they are numbered from 0."""
FULL_TURN_TOLERANCE = 1e-6
"""Difference from a full turn that is rounding, rad."""


DistortionCoefficient = Annotated[float, Meta(ge=-100, le=100)]
MAX_CLIFF_SENSORS = 4
"""Number of inputs for cliff sensors of the motor board (firmware/core/robot.h)."""
CLIFF_RATE = 50.0
"""Rate of the motor board's lines about cliffs, Hz."""
CLIFF_FIELD_OF_VIEW = math.radians(2.0)
"""Width of the sensors' beam, rad: a few millimetres of floor."""


class CliffPosition(RobotSection, frozen=True, kw_only=True):
    """Position of a cliff sensor in base_link."""

    x: Coordinate
    y: Coordinate = 0.0


class ImuSpec(RobotSection, frozen=True, kw_only=True):
    """An inertial measurement unit with gyro and accelerometer."""

    mount: Mount
    housing: Housing
    rate: Rate
    gyro_noise: Annotated[float, Meta(ge=0, le=1, extra={"unit": "rad/s"})]
    """Standard deviation of one reading."""
    gyro_bias: Annotated[float, Meta(ge=0, le=1, extra={"unit": "rad/s"})]
    """Standard deviation of the turn-on bias."""
    accelerometer_noise: Annotated[float, Meta(ge=0, le=10, extra={"unit": "m/s^2"})]
    driver: str = ""
    """Model on a serial line of its own, one of IMU_DRIVERS; without it, the IMU is wired to the motor board."""
    port: Annotated[str, Meta(min_length=1)] = AUTO
    """Serial port of such an IMU, best a path in /dev/serial/by-id; auto: where it sends."""


class Ultrasonic(RobotSection, frozen=True, kw_only=True):
    """An ultrasonic range finder with a conical field of view."""

    mount: Mount
    housing: Housing
    rate: Rate
    field_of_view: FieldOfView
    range_min: Length
    range_max: Length


class CliffSensor(NamedTuple):
    """One downward rangefinder that reports whether there is floor within its range."""

    mount: Mount
    housing: Housing
    rate: float
    field_of_view: float
    range_min: float
    range_max: float


class CliffSensors(RobotSection, frozen=True, kw_only=True):
    """Infrared rangefinders that look down and report whether there is floor within their range.

    They are connected to the inputs of the motor board in this order.
    """

    positions: Annotated[tuple[CliffPosition, ...], Meta(min_length=1, max_length=MAX_CLIFF_SENSORS)]
    height: Length
    """Height of the sensors above the floor."""
    housing: Housing
    range: Length
    """Distance within which a sensor sees the floor."""

    @property
    def sensors(self) -> tuple[CliffSensor, ...]:
        """The sensors; the x axis of each frame points down."""
        mounts = [Mount(x=at.x, y=at.y, z=self.height, pitch=math.pi / 2.0) for at in self.positions]
        limits = CLIFF_RATE, CLIFF_FIELD_OF_VIEW, self.range, self.range
        return tuple(CliffSensor(mount, self.housing, *limits) for mount in mounts)


class Camera(RobotSection, frozen=True, kw_only=True):
    """What every camera has: its mount, its image in pixels, and its field of view."""

    mount: Mount
    housing: Housing
    rate: Rate
    width: Count
    height: Count
    field_of_view: FieldOfView
    """Horizontal field of view."""

    @property
    def focal_length_px(self) -> float:
        """Focal length in pixels, for square pixels."""
        return self.width / 2.0 / math.tan(self.field_of_view / 2.0)

    @property
    def half_height(self) -> float:
        """Half the height of the picture on a plane one metre ahead, m."""
        return self.height / 2.0 / self.focal_length_px


class Lens(RobotSection, frozen=True, kw_only=True):
    """Calibration of a camera for images of its width and height, as `camera_calibration` of ROS prints it."""

    fx: Annotated[float, Meta(gt=0, le=1e5)]
    """Focal length in pixels, as fy; cx, cy: pixel at which the optical axis meets the image."""
    fy: Annotated[float, Meta(gt=0, le=1e5)]
    cx: Annotated[float, Meta(ge=0, le=1e5)]
    cy: Annotated[float, Meta(ge=0, le=1e5)]
    distortion: Annotated[tuple[DistortionCoefficient, ...], Meta(min_length=4, max_length=5)] = (0.0,) * 5
    """k1, k2, p1, p2 and k3 of the model plumb_bob."""


class TagSpec(RobotSection, frozen=True, kw_only=True):
    """AprilTags that a camera detects."""

    family: TagFamily = "tag36h11"
    size: Length
    """Side of the outer edge of the black square; all tags have the same."""


class ColorCamera(Camera, frozen=True, kw_only=True):
    """A colour camera, such as a USB camera: its picture for operators, and the AprilTags in it."""

    driver: str = ""
    """Kind that the built robot has, one of COLOR_CAMERA_DRIVERS; without it, images come from another machine."""
    device: Annotated[str, Meta(min_length=1)] = AUTO
    """Device file, best a path in /dev/v4l/by-id, or a video file; auto: the only USB camera."""
    lens: Lens | None = None
    """Calibration; without it, square pixels, the field of view, and no distortion."""
    tags: TagSpec | None = None
    """AprilTags to detect; without it, none."""

    @property
    def intrinsics(self) -> Lens:
        """The calibration, or that of an ideal camera with this field of view."""
        f, cx, cy = self.focal_length_px, (self.width - 1) / 2.0, (self.height - 1) / 2.0
        return self.lens or Lens(fx=f, fy=f, cx=cx, cy=cy)


class DepthCamera(Camera, frozen=True, kw_only=True):
    """A camera that measures depth along its optical axis."""

    range_min: Length
    range_max: Annotated[float, Meta(gt=0, le=100, extra={"unit": "m"})]
    noise: Annotated[float, Meta(ge=0, le=1)]
    """Noise coefficient: standard deviation of depth z is `noise * z^2` metres, as for structured light."""
    driver: str = ""
    """Kind that the built robot has, one of DEPTH_CAMERA_DRIVERS; without it, images come from another machine."""
    serial: Annotated[str, Meta(min_length=1)] = AUTO
    """Serial number of the built robot's camera; auto: the only one of its kind that is connected."""

    def range_with_noise(self, deviation: float) -> float:
        """Return the range, m, up to which the standard deviation of depth is at most `deviation` metres."""
        noise_limited_range = math.sqrt(deviation / self.noise) if self.noise > 0.0 else math.inf
        return min(self.range_max, noise_limited_range)


class Lidar(RobotSection, frozen=True, kw_only=True):
    """A 2D lidar that scans a full turn in its plane, or a part of it around its forward direction."""

    mount: Mount
    housing: Housing
    rate: Rate
    beams: Annotated[int, Meta(ge=3, le=1_000_000)]
    """Ranges of one scan."""
    field_of_view: FieldOfView = 2.0 * math.pi
    """Angle of one scan, by default a full turn; the forward direction of the mount is in its middle."""
    range_min: Length
    range_max: Annotated[float, Meta(gt=0, le=200, extra={"unit": "m"})]
    noise: Annotated[float, Meta(ge=0, le=1, extra={"unit": "m"})]
    """Standard deviation of a range."""
    driver: str = ""
    """Model that the built robot has, one of LIDAR_DRIVERS; without it, its scans come from another machine."""
    port: Annotated[str, Meta(min_length=1)] = AUTO
    """Serial port of the built robot's lidar, best a path in /dev/serial/by-id; auto: where such a lidar sends."""

    @property
    def full_turn(self) -> bool:
        """Whether the scan closes: its last beam is one step before its first."""
        return self.field_of_view >= 2.0 * math.pi - FULL_TURN_TOLERANCE

    @property
    def angle_min(self) -> float:
        """Bearing of the first beam in the lidar frame, rad."""
        return -self.field_of_view / 2.0

    @property
    def angle_increment(self) -> float:
        """Angle between two beams, rad."""
        return self.field_of_view / (self.beams if self.full_turn else self.beams - 1)

    @property
    def angle_max(self) -> float:
        """Bearing of the last beam in the lidar frame, rad."""
        return self.field_of_view / 2.0 - (self.angle_increment if self.full_turn else 0.0)


class Sensors(RobotSection, frozen=True, kw_only=True):
    """Mounted sensors; the robot maps with the lidar if it has one, otherwise with the depth camera."""

    imu: ImuSpec
    ultrasonic: Ultrasonic | None = None
    cliffs: CliffSensors | None = None
    depth_camera: DepthCamera | None = None
    color_camera: ColorCamera | None = None
    lidar: Lidar | None = None

    @property
    def by_frame(self) -> dict[str, ImuSpec | Ultrasonic | CliffSensor | DepthCamera | ColorCamera | Lidar]:
        """Mounted sensors by the name of their frame (REP-105 and driver conventions)."""
        sensors = {
            "imu_link": self.imu,
            "ultrasonic_link": self.ultrasonic,
            **self.cliff_sensors,
            "camera_link": self.depth_camera,
            "color_camera_link": self.color_camera,
            "laser": self.lidar,
        }
        return {frame: sensor for frame, sensor in sensors.items() if sensor is not None}

    @property
    def cliff_sensors(self) -> dict[str, CliffSensor]:
        """Cliff sensors by the name of their frame, in the order of the motor board's inputs."""
        sensors = self.cliffs.sensors if self.cliffs is not None else ()
        return {f"cliff_{i}_link": sensor for i, sensor in enumerate(sensors)}

    @property
    def forward_sensing_only(self) -> bool:
        """Whether no sensor covers the sides of the robot."""
        return self.lidar is None or self.lidar.field_of_view <= math.pi

    @property
    def sees_one_plane(self) -> bool:
        """Whether obstacles are seen at the height of the lidar only: no table top, hanging board or drop-off."""
        return self.lidar is not None and self.depth_camera is None

    @property
    def covers_rear(self) -> bool:
        """Whether a sensor covers what is behind the robot."""
        return self.lidar is not None and self.lidar.full_turn
