"""In which order to get out of trouble, as data."""

from __future__ import annotations

import math
from enum import Enum
from typing import Annotated

import msgspec
from msgspec import Meta

CAREFUL = 0.4
"""Share of the robot's speed for recoveries: its sensors look forward, not back."""


class Recovery(Enum):
    """What can be tried."""

    CLEAR = "forget obstacles seen around"
    BACK_UP = "back up"
    SPIN = "turn about and look"
    WAIT = "wait for people to pass"


ORDER = (Recovery.CLEAR, Recovery.BACK_UP, Recovery.SPIN, Recovery.WAIT)
"""After each of them the path is planned again; the mildest comes first."""
LOOK_FIRST = (Recovery.SPIN, Recovery.WAIT, Recovery.CLEAR, Recovery.BACK_UP)
"""The order for a robot that looks ahead only: what has left is seen to have left by turning towards it, and nothing
is forgotten, or backed into, that it has not just looked at."""


def order_for(*, look_ahead_only: bool) -> tuple[Recovery, ...]:
    """The order in which a robot with such sensors tries them."""
    return LOOK_FIRST if look_ahead_only else ORDER


class RecoveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How far and how long each remedy goes."""

    back_up: Annotated[float, Meta(ge=0.02, le=1.0, description="how far to back up, m")] = 0.2
    spin: Annotated[float, Meta(ge=0.1, le=12.6, description="how far to turn about, rad")] = 2.0 * math.pi
    wait: Annotated[float, Meta(ge=0.1, le=600.0, description="how long to wait, s")] = 5.0
    clear_radius: Annotated[
        float, Meta(ge=0.1, le=20.0, description="seen obstacles this near are forgotten, m")
    ] = 2.0
    rounds: Annotated[int, Meta(ge=1, le=100, description="times through the order before giving up")] = 2
