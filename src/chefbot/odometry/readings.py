"""Readings of the motion sensors. Each is stamped with the time of measurement in nanoseconds."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

UNMEASURED_VARIANCES = (math.inf, math.inf, math.inf)
"""Variances of three axes that were not measured."""
Triple = tuple[float, float, float]


class WheelCounts(NamedTuple):
    """Counts of the left and right encoder, read at the same time."""

    stamp_ns: int
    left: int
    right: int


class WheelTwist(NamedTuple):
    """A twist from a base that measures speeds instead of counts: means over the time since its last reading.

    speed: along x, m/s. turn: about z, rad/s. speed_variance (m/s)^2, turn_variance (rad/s)^2.
    slide_variance: of the speed to the left and up, whose mean is zero, (m/s)^2.
    """

    stamp_ns: int
    speed: float
    turn: float
    speed_variance: float
    turn_variance: float
    slide_variance: float


class ImuReading(NamedTuple):
    """A reading of gyro, accelerometer and, if the sensor computes it, attitude, in the axes of base_link.

    rates: mean angular velocity over the time since the last reading, rad/s. force: specific force,
    acceleration minus gravity, so that z reads +9.8 at rest, m/s^2. attitude: roll, pitch, yaw in odom, rad.
    An infinite variance marks an axis that is not measured; rates about x and y are used only together.
    """

    stamp_ns: int
    rates: Triple
    rates_variance: Triple
    force: Triple = (0.0, 0.0, 0.0)
    force_variance: Triple = UNMEASURED_VARIANCES
    attitude: Triple = (0.0, 0.0, 0.0)
    attitude_variance: Triple = UNMEASURED_VARIANCES


IMU = np.dtype(
    [
        ("stamp_ns", np.int64),
        ("rates", np.float64, 3),
        ("rates_variance", np.float64, 3),
        ("force", np.float64, 3),
        ("force_variance", np.float64, 3),
        ("attitude", np.float64, 3),
        ("attitude_variance", np.float64, 3),
    ]
)
"""Record of an `ImuReading`, with the same fields."""

Reading = WheelCounts | WheelTwist | ImuReading
_RANKS = {ImuReading: 0, WheelTwist: 1, WheelCounts: 1}
Key = tuple[int, int]


def order(reading: Reading) -> Key:
    """Return the sort key of a reading: by stamp, with the wheels, which close a step, last.

    Readings of the same key are sorted by `repr`, that is, by their values, so that the order is total.
    """
    return reading.stamp_ns, _RANKS[type(reading)]
