"""What the sensors of motion say. Each reading is stamped with the instant it was taken, in nanoseconds."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.maths.se2 import SE2

UNTOLD = (math.inf, math.inf, math.inf)
"""Variances of three axes that were not measured."""
Triple = tuple[float, float, float]


class WheelCounts(NamedTuple):
    """Both encoders of this robot, read together."""

    stamp_ns: int
    left: int
    right: int


class WheelTwist(NamedTuple):
    """A base that tells speeds instead of counts: means over the time since its last reading.

    speed: along x, m/s. turn: about z, rad/s. Variances: of both, (m/s)^2 and (rad/s)^2, and of the speed to
    the left and up, which is zero but for slides and jumps, (m/s)^2.
    """

    stamp_ns: int
    speed: float
    turn: float
    speed_variance: float
    turn_variance: float
    slide_variance: float


class ImuReading(NamedTuple):
    """Gyro, accelerometer and, where the sensor has worked it out, attitude, along the robot's axes.

    rates: mean over the time since the last reading, rad/s. force: acceleration minus gravity, so that z reads
    +9.8 at rest, m/s^2. attitude: roll, pitch, yaw in odom, rad. An infinite variance says that the axis is
    not measured; rates about x and y count only together.
    """

    stamp_ns: int
    rates: Triple
    rates_variance: Triple
    force: Triple = (0.0, 0.0, 0.0)
    force_variance: Triple = UNTOLD
    attitude: Triple = (0.0, 0.0, 0.0)
    attitude_variance: Triple = UNTOLD


class PoseReading(NamedTuple):
    """Where the robot is in odom by matching scans.

    covariance: (x, y, yaw), 3 x 3 by rows, m^2, m rad, rad^2; positive definite.
    """

    stamp_ns: int
    pose: SE2
    covariance: tuple[Triple, Triple, Triple]


Reading = WheelCounts | WheelTwist | ImuReading | PoseReading
_RANKS = {ImuReading: 0, PoseReading: 1, WheelTwist: 2, WheelCounts: 2}
Key = tuple[int, int, str]


def order(reading: Reading) -> Key:
    """Sorts readings in the only order that there is: by stamp; the wheels, which close a step, come last.

    Two of one kind and stamp are sorted by what they say.
    """
    return reading.stamp_ns, _RANKS[type(reading)], repr(reading)
