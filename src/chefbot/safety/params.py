"""Parameters of the drive base: limiter, priority of teleoperation and safety margin."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.safety.velocity_limiter import VelocityLimiterParams


class DriveBaseParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the velocity limiter, the teleop priority and the ultrasonic safety margin."""

    limiter: VelocityLimiterParams = VelocityLimiterParams()
    teleop_hold: Annotated[
        float,
        Meta(ge=0, le=10, description="time after the last teleop command before navigation is accepted, s"),
    ] = 1.0
    ultrasonic_margin: Annotated[
        float, Meta(ge=0, le=1, description="safety margin to obstacles of the ultrasonic ranger, m")
    ] = 0.04
