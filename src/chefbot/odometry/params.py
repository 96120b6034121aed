"""Noise parameters of the odometry that the robot file does not contain."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta


class OdometryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The standard deviations of the errors of wheels and gyro."""

    slip: Annotated[
        float,
        Meta(
            ge=0,
            le=0.2,
            description="error of a wheel's travel after a metre, m; it grows with the root of the distance",
        ),
    ] = 0.003
    diameter_error: Annotated[
        float, Meta(ge=0, le=0.1, description="error of a wheel's diameter, as a share of it (no unit)")
    ] = 0.003
    separation_error: Annotated[
        float, Meta(ge=0, le=0.2, description="error of the wheels' separation, as a share of it (no unit)")
    ] = 0.005
    gyro_scale_error: Annotated[
        float, Meta(ge=0, le=0.1, description="error of the gyro's sensitivity, as a share of it (no unit)")
    ] = 0.003
    gyro_bias_walk: Annotated[
        float, Meta(ge=0, le=0.01, description="how far the gyro's offset wanders in a second, rad/s")
    ] = 2e-5
