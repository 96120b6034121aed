"""Types of values in a robot file: quantities with unit and bounds, counts, names and texts."""

from __future__ import annotations

import math
from typing import Annotated

from msgspec import Meta

Length = Annotated[float, Meta(gt=0, le=10, extra={"unit": "m"})]
Distance = Annotated[float, Meta(ge=0, le=10, extra={"unit": "m"})]
Coordinate = Annotated[float, Meta(ge=-10, le=10, extra={"unit": "m"})]
Mass = Annotated[float, Meta(gt=0, le=1000, extra={"unit": "kg"})]
Speed = Annotated[float, Meta(gt=0, le=10, extra={"unit": "m/s"})]
Acceleration = Annotated[float, Meta(gt=0, le=50, extra={"unit": "m/s^2"})]
AngularSpeed = Annotated[float, Meta(gt=0, le=500, extra={"unit": "rad/s"})]
AngularAcceleration = Annotated[float, Meta(gt=0, le=500, extra={"unit": "rad/s^2"})]
Torque = Annotated[float, Meta(gt=0, le=1000, extra={"unit": "N m"})]
Angle = Annotated[float, Meta(ge=-2 * math.pi, le=2 * math.pi, extra={"unit": "rad"})]
Slope = Annotated[float, Meta(ge=0, le=0.8, extra={"unit": "rad"})]
FieldOfView = Annotated[float, Meta(gt=0, le=2 * math.pi, extra={"unit": "rad"})]
Voltage = Annotated[float, Meta(gt=0, le=100, extra={"unit": "V"})]
Current = Annotated[float, Meta(gt=0, le=1000, extra={"unit": "A"})]
Charge = Annotated[float, Meta(gt=0, le=1e7, extra={"unit": "C"})]
Power = Annotated[float, Meta(gt=0, le=10_000, extra={"unit": "W"})]
Duration = Annotated[float, Meta(gt=0, le=1e6, extra={"unit": "s"})]
Rate = Annotated[float, Meta(gt=0, le=1000, extra={"unit": "Hz"})]
Count = Annotated[int, Meta(gt=0, le=1_000_000)]
Ratio = Annotated[float, Meta(gt=0, le=10)]
MIN_CALIBRATION, MAX_CALIBRATION = 0.8, 1.25
CalibrationFactor = Annotated[float, Meta(ge=MIN_CALIBRATION, le=MAX_CALIBRATION)]
"""Ratio of a measured quantity to the drawn one; outside these bounds it is another robot."""
SmallAngle = Annotated[float, Meta(ge=-0.5, le=0.5, extra={"unit": "rad"})]
RateOffset = Annotated[float, Meta(ge=-0.5, le=0.5, extra={"unit": "rad/s"})]
RelativeStdDev = Annotated[float, Meta(gt=0, le=0.1)]
Share = Annotated[float, Meta(gt=0, le=1)]
Name = Annotated[
    str,
    Meta(
        max_length=64,
        pattern=r"^[a-z][a-z0-9_]*$",
        extra={"form": "small letters of English, digits and _, a letter first"},
    ),
]
Text = Annotated[str, Meta(max_length=600)]
