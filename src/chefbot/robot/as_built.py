"""How one robot differs from its drawing."""

from __future__ import annotations

from typing import NamedTuple


class AsBuilt(NamedTuple):
    """Deviations of one robot from its robot file: factors on dimensions, and misaligned sensors.

    left_wheel, right_wheel: factors on the wheel radii; separation, friction, gyro_scale: factors; lidar_yaw and
    camera_yaw: radians beyond the mount's yaw, to the left; left_encoder, right_encoder: -1 if the wires are swapped;
    lidar_upside_down, camera_upside_down: whether the sensor is turned by 180 degrees about its forward axis.
    """

    left_wheel: float = 1.0
    right_wheel: float = 1.0
    separation: float = 1.0
    friction: float = 1.0
    gyro_scale: float = 1.0
    lidar_yaw: float = 0.0
    camera_yaw: float = 0.0
    left_encoder: int = 1
    right_encoder: int = 1
    lidar_upside_down: bool = False
    camera_upside_down: bool = False


AS_DRAWN = AsBuilt()
