"""Parameters of the battery monitor."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class BatteryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Shares of the charge at which the robot warns, goes home and parks."""

    warn: Annotated[float, Meta(ge=0.05, le=0.95, description="share below which the operator is warned")] = (
        0.4
    )
    return_home: Annotated[
        float, Meta(ge=0.05, le=0.9, description="share below which no order begins and the robot goes home")
    ] = 0.25
    park: Annotated[
        float, Meta(ge=0.02, le=0.5, description="share that no drive is planned with, except to park")
    ] = 0.15
    hysteresis: Annotated[
        float, Meta(ge=0.01, le=0.5, description="rise above a share after which its level ends")
    ] = 0.1
