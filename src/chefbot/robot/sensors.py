"""Sections of a robot file that say what senses: IMU, ultrasonic ranger, depth camera, lidar."""

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
from chefbot.robot.section import Housing, Mount, Part


class Imu(Part, frozen=True, kw_only=True):
    """Gyro and accelerometer."""

    mount: Mount
    housing: Housing
    rate: Rate
    gyro_noise: Annotated[float, Meta(ge=0, le=1, extra={"unit": "rad/s"})]
    """Standard deviation of one reading."""
    gyro_bias: Annotated[float, Meta(ge=0, le=1, extra={"unit": "rad/s"})]
    """Standard deviation of the offset that a start leaves."""
    accelerometer_noise: Annotated[float, Meta(ge=0, le=10, extra={"unit": "m/s^2"})]


class Ultrasonic(Part, frozen=True, kw_only=True):
    """A ranger with a cone."""

    mount: Mount
    housing: Housing
    rate: Rate
    field_of_view: FieldOfView
    range_min: Length
    range_max: Length


class DepthCamera(Part, frozen=True, kw_only=True):
    """A camera that measures distance along its optical axis."""

    mount: Mount
    housing: Housing
    rate: Rate
    width: Count
    height: Count
    field_of_view: FieldOfView
    """Horizontal."""
    range_min: Length
    range_max: Annotated[float, Meta(gt=0, le=100, extra={"unit": "m"})]
    noise: Annotated[float, Meta(ge=0, le=1)]
    """Standard deviation of depth z is `noise * z^2` metres, as of structured light."""

    @property
    def focal_length_px(self) -> float:
        """Pixels, square ones."""
        return self.width / 2.0 / math.tan(self.field_of_view / 2.0)

    def range_with_noise(self, deviation: float) -> float:
        """Metres up to which the standard deviation of a depth is at most `deviation` metres."""
        wanted = math.sqrt(deviation / self.noise) if self.noise > 0.0 else math.inf
        return min(self.range_max, wanted)


class Lidar(Part, frozen=True, kw_only=True):
    """A scanner that turns in the plane."""

    mount: Mount
    housing: Housing
    rate: Rate
    beams: Count
    range_min: Length
    range_max: Annotated[float, Meta(gt=0, le=200, extra={"unit": "m"})]
    noise: Annotated[float, Meta(ge=0, le=1, extra={"unit": "m"})]
    """Standard deviation of a range."""


class Sensors(Part, frozen=True, kw_only=True):
    """What is mounted; a robot maps with the lidar where there is one, else with the camera."""

    imu: Imu
    ultrasonic: Ultrasonic | None = None
    depth_camera: DepthCamera | None = None
    lidar: Lidar | None = None

    @property
    def by_frame(self) -> dict[str, Imu | Ultrasonic | DepthCamera | Lidar]:
        """What is mounted, by the name of its frame (REP-105 and the drivers' usage)."""
        named = {
            "imu_link": self.imu,
            "ultrasonic_link": self.ultrasonic,
            "camera_link": self.depth_camera,
            "laser": self.lidar,
        }
        return {frame: sensor for frame, sensor in named.items() if sensor is not None}

    @property
    def look_ahead_only(self) -> bool:
        """Whether nothing sees what is beside the robot."""
        return self.lidar is None
