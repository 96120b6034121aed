"""Parameters of the calibration drive."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

SETTLING_TIME = 0.6
"""Pause between the end of a motion and the first scan, s."""


class CalibratorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Number and size of the squares, and the settling time."""

    squares: Annotated[
        int, Meta(ge=1, le=20, description="squares each way to calibrate by, and as many to check it")
    ] = 4
    side: Annotated[
        float, Meta(ge=0, le=10, description="of the squares, m; 0: as large as there is room")
    ] = 0.0
    settle: Annotated[float, Meta(ge=0, le=5, description="pause before the first look of a stand, s")] = (
        SETTLING_TIME
    )
