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
        int, Meta(ge=1, le=20, description="squares per direction; the same number again for validation")
    ] = 4
    side: Annotated[
        float, Meta(ge=0, le=10, description="side length of the squares, m; 0: the largest that fits")
    ] = 0.0
    settle: Annotated[
        float, Meta(ge=0, le=5, description="settling time before the first scan at a station, s")
    ] = SETTLING_TIME
