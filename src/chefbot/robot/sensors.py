"""Sensor sections of a robot file: IMU, ultrasonic ranger, depth camera and lidar."""

from __future__ import annotations

import math
from typing import Annotated

from msgspec import Meta

from chefbot.robot.quantities import (
    Count,
    FieldOfView,
    Length,
    Rate,
)
from chefbot.robot.section import Housing, Mount, RobotSection

FULL_TURN_TOLERANCE = 1e-6
"""Difference from a full turn that is rounding, rad."""


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


class Ultrasonic(RobotSection, frozen=True, kw_only=True):
    """An ultrasonic range finder with a conical field of view."""

    mount: Mount
    housing: Housing
    rate: Rate
    field_of_view: FieldOfView
    range_min: Length
    range_max: Length


class DepthCamera(RobotSection, frozen=True, kw_only=True):
    """A camera that measures depth along its optical axis."""

    mount: Mount
    housing: Housing
    rate: Rate
    width: Count
    height: Count
    field_of_view: FieldOfView
    """Horizontal field of view."""
    range_min: Length
    range_max: Annotated[float, Meta(gt=0, le=100, extra={"unit": "m"})]
    noise: Annotated[float, Meta(ge=0, le=1)]
    """Noise coefficient: standard deviation of depth z is `noise * z^2` metres, as for structured light."""

    @property
    def focal_length_px(self) -> float:
        """Focal length in pixels, for square pixels."""
        return self.width / 2.0 / math.tan(self.field_of_view / 2.0)

    @property
    def half_height(self) -> float:
        """Half the height of the picture on a plane one metre ahead, m."""
        return self.height / 2.0 / self.focal_length_px

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
    depth_camera: DepthCamera | None = None
    lidar: Lidar | None = None

    @property
    def by_frame(self) -> dict[str, ImuSpec | Ultrasonic | DepthCamera | Lidar]:
        """Mounted sensors by the name of their frame (REP-105 and driver conventions)."""
        sensors = {
            "imu_link": self.imu,
            "ultrasonic_link": self.ultrasonic,
            "camera_link": self.depth_camera,
            "laser": self.lidar,
        }
        return {frame: sensor for frame, sensor in sensors.items() if sensor is not None}

    @property
    def forward_sensing_only(self) -> bool:
        """Whether no sensor covers the sides of the robot."""
        return self.lidar is None or self.lidar.field_of_view <= math.pi

    @property
    def covers_rear(self) -> bool:
        """Whether a sensor covers what is behind the robot."""
        return self.lidar is not None and self.lidar.full_turn
