"""Parameters of the drive base: limiter, priority of teleoperation and collision monitor."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from chefbot.safety.velocity_limiter import VelocityLimiterParams

SMALLER_IS_SAFER, LARGER_IS_SAFER = {"safer": "smaller"}, {"safer": "larger"}


SensorName = Literal["lidar", "depth camera", "ultrasonic ranger"]
"""An obstacle sensor by its name in sentences for the operator."""


class CollisionMonitorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Margins and times of the collision monitor; all distances of braking follow from the robot file."""

    margin: Annotated[
        float,
        Meta(
            ge=0.0,
            le=1.0,
            description="distance at which the robot stands before an obstacle, m",
            extra=LARGER_IS_SAFER,
        ),
    ] = 0.02
    side_margin: Annotated[
        float,
        Meta(
            ge=0.0,
            le=1.0,
            description="distance beside the body that must be free to drive at all, m",
            extra=LARGER_IS_SAFER,
        ),
    ] = 0.01
    slow_margin: Annotated[
        float,
        Meta(
            ge=0.0,
            le=1.0,
            description="distance beside the body that must be free for more than `slowdown_ratio`, m",
            extra=LARGER_IS_SAFER,
        ),
    ] = 0.02
    slowdown_ratio: Annotated[
        float,
        Meta(
            ge=0.05,
            le=1.0,
            description="fraction of the maximum speed near obstacles and over ground not seen recently",
            extra=SMALLER_IS_SAFER,
        ),
    ] = 0.5
    obstacle_memory_time: Annotated[
        float,
        Meta(
            ge=5.0,
            le=600.0,
            description="time for which a seen obstacle is remembered, s",
            extra=LARGER_IS_SAFER,
        ),
    ] = 60.0
    ground_memory_time: Annotated[
        float,
        Meta(
            ge=1.0,
            le=60.0,
            description="time for which ground that was seen free counts as free, s",
            extra=SMALLER_IS_SAFER,
        ),
    ] = 30.0
    optional_sensors: tuple[SensorName, ...] = ()
    """Sensors of the robot file that need not be connected: they count from their first message on."""


class DriveBaseParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the velocity limiter, the teleop priority and the collision monitor."""

    limiter: VelocityLimiterParams = VelocityLimiterParams()
    teleop_hold: Annotated[
        float,
        Meta(
            ge=0,
            le=10,
            description="time after the last teleop command before navigation is accepted, s",
            extra=LARGER_IS_SAFER,
        ),
    ] = 1.0
    ultrasonic_margin: Annotated[
        float,
        Meta(
            ge=0,
            le=1,
            description="safety margin to obstacles of the ultrasonic ranger, m",
            extra=LARGER_IS_SAFER,
        ),
    ] = 0.04
    monitor: CollisionMonitorParams = CollisionMonitorParams()
