"""Parameters of the battery monitor."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class BatteryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Shares of the charge at which the robot warns, goes home and parks."""

    warn: Annotated[
        float, Meta(ge=0.05, le=0.95, description="charge below which the operator is warned, 0..1")
    ] = 0.4
    return_home: Annotated[
        float,
        Meta(ge=0.05, le=0.9, description="charge below which no order begins and the robot goes home, 0..1"),
    ] = 0.25
    park: Annotated[
        float,
        Meta(ge=0.02, le=0.5, description="reserve of charge kept for parking, 0..1; no other drive uses it"),
    ] = 0.15
    hysteresis: Annotated[
        float,
        Meta(ge=0.01, le=0.5, description="rise of the charge above a threshold that ends its level, 0..1"),
    ] = 0.1
