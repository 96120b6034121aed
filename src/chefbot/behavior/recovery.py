"""Sequence of the recovery behaviors, as data."""

from __future__ import annotations

import math
from enum import Enum
from typing import Annotated

import msgspec
from msgspec import Meta

BACK_UP_SPEED_FRACTION = 0.4
"""Fraction of the maximum speed for backing up: the sensors look forward, not back."""


class RecoveryBehavior(Enum):
    """Recovery behaviors that can be run."""

    CLEAR = "forget obstacles seen around"
    BACK_UP = "back up"
    SPIN = "turn about and look"
    WAIT = "wait for people to pass"


DEFAULT_SEQUENCE = (
    RecoveryBehavior.CLEAR,
    RecoveryBehavior.BACK_UP,
    RecoveryBehavior.SPIN,
    RecoveryBehavior.WAIT,
)
"""Default sequence, least intrusive first; the path is planned again after each behavior."""
LOOK_AHEAD_SEQUENCE = (
    RecoveryBehavior.SPIN,
    RecoveryBehavior.WAIT,
    RecoveryBehavior.CLEAR,
    RecoveryBehavior.BACK_UP,
)
"""Sequence for a robot whose sensors look ahead only.

Turning clears obstacles that have left, and the robot does not clear, or back into, an area that it has not just
scanned."""


def recovery_sequence(*, forward_sensing_only: bool) -> tuple[RecoveryBehavior, ...]:
    """Return the recovery sequence for a robot with such sensors."""
    return LOOK_AHEAD_SEQUENCE if forward_sensing_only else DEFAULT_SEQUENCE


class RecoveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the recovery behaviors and their number of rounds."""

    back_up: Annotated[float, Meta(ge=0.02, le=1.0, description="how far to back up, m")] = 0.2
    spin: Annotated[float, Meta(ge=0.1, le=12.6, description="how far to turn about, rad")] = 2.0 * math.pi
    wait: Annotated[float, Meta(ge=0.1, le=600.0, description="how long to wait, s")] = 5.0
    clear_radius: Annotated[
        float, Meta(ge=0.1, le=20.0, description="seen obstacles this near are forgotten, m")
    ] = 2.0
    rounds: Annotated[int, Meta(ge=1, le=100, description="times through the order before giving up")] = 2
