"""Parameters of the deliveries."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class DeliveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Names of kitchen and home, and timers that replace the buttons."""

    kitchen: Annotated[str, Meta(min_length=1, description="name of the place where food is loaded")] = (
        "kitchen"
    )
    home: Annotated[str, Meta(min_length=1, description="name of the place to wait for orders")] = "home"
    loading_timeout: Annotated[
        float,
        Meta(ge=0, le=3600, description="loading timeout, s; 0: wait for 'Loaded'"),
    ] = 0.0
    pickup_timeout: Annotated[
        float,
        Meta(ge=0, le=3600, description="pickup timeout, s; 0: wait for 'Taken'"),
    ] = 0.0
    stop_time: Annotated[
        float,
        Meta(ge=0, le=3600, description="time that a stop takes on average, s; for the energy of an order"),
    ] = 60.0
    trays: Annotated[
        int,
        Meta(ge=0, le=9, description="number of trays, each for one table; 0: the food of all tables fits"),
    ] = 0
