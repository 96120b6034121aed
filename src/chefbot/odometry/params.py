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
            description="standard deviation of a wheel's travel after one metre, m; grows with its square root",
        ),
    ] = 0.003
    diameter_error: Annotated[
        float, Meta(ge=0, le=0.1, description="relative standard deviation of a wheel's diameter (no unit)")
    ] = 0.003
    separation_error: Annotated[
        float, Meta(ge=0, le=0.2, description="relative standard deviation of the wheel separation (no unit)")
    ] = 0.005
    gyro_scale_error: Annotated[
        float, Meta(ge=0, le=0.1, description="relative standard deviation of the gyro scale (no unit)")
    ] = 0.003
    gyro_bias_walk: Annotated[
        float, Meta(ge=0, le=0.01, description="random walk of the gyro bias in one second, rad/s")
    ] = 2e-5
