"""Whether the robot tips over, is lifted aslant or has fallen, by gyro and accelerometer."""

from __future__ import annotations

import math
import operator

import numpy as np

from chefbot.odometry.readings import ImuReading, Triple
from chefbot.odometry.sensor_health import NEVER_NS
from chefbot.robot.spec import GRAVITY

MAX_TILT = math.radians(20.0)
"""Tilt from which the robot is tipping over, rad. Ramps for wheels are under 7 degrees; braking pitches by less."""
UPRIGHT = math.radians(10.0)
"""Tilt up to which it stands upright, rad."""
UPRIGHT_NS = 1_000_000_000
"""Time for which it must have been upright before it counts as such, ns; and time after which gyro and accelerometer
that contradict each other show nothing: a fall is shorter."""
SMOOTHING = 0.2
"""Time constant of the specific force, s: impacts and free fall are shorter."""
CORRECTION = 2.0
"""Time constant with which the accelerometer corrects the direction that the gyro has integrated, s."""
MAX_CONTRADICTION = math.radians(45.0)
"""Angle between the directions of the two from which they contradict each other, rad."""
MAX_GAP_NS = 300_000_000
"""Time without readings after which the direction is no longer known, ns."""
UP: Triple = (0.0, 0.0, 1.0)


class TiltDetector:
    """Judges whether the robot has tipped over; gyro and accelerometer must both show it.

    The gyro is integrated to the upward direction in the robot's axes, and the accelerometer corrects it slowly, as
    in a complementary filter (Mahony, Hamel & Pflimlin 2008, "Nonlinear complementary filters on the special
    orthogonal group"). A force that turns without the robot is an impact, a bend or a sensor that is mounted
    otherwise, and a rotation without its force is an offset of the gyro. The robot can only tip over after it has
    been upright; without an accelerometer it never does.
    """

    def __init__(self) -> None:
        self.tilted = False
        """Whether the robot has tipped over and has not been upright since."""
        self.upright = False
        """Whether it has been upright for a while, up to now."""
        self._is_known = False
        self._up = self._force = UP
        self._stamp_ns = self._aslant_ns = self._agreed_ns = NEVER_NS

    def process(self, reading: ImuReading) -> bool:
        """Process a reading; return whether the robot has just tipped over. A late or infinite one is left out."""
        passed_ns = reading.stamp_ns - self._stamp_ns
        if -MAX_GAP_NS <= passed_ns <= 0 or not np.isfinite((reading.rates, reading.force)).all():
            return False
        self._stamp_ns = reading.stamp_ns
        if abs(passed_ns) > MAX_GAP_NS:  # the first one, or the clock was set back
            passed_ns, self._is_known = 0, False
            self._force, self._aslant_ns = reading.force, reading.stamp_ns
        seconds = passed_ns * 1e-9
        if math.isfinite(max(reading.rates_variance[:2])):
            self._up = _unit(_turned(self._up, reading.rates, seconds))
        if math.isfinite(max(reading.force_variance)):
            self._force = _towards(self._force, reading.force, seconds / SMOOTHING)
            self._compare(seconds)
        was_tilted = self.tilted
        shown = min(_angle(self._up, UP), _angle(_unit(self._force), UP)) > MAX_TILT
        self.tilted = not self.upright and (was_tilted or (self._is_known and shown))
        return self.tilted and not was_tilted

    def _compare(self, seconds: float) -> None:
        """Correct the direction by the accelerometer, and begin with it where that shows an upright robot."""
        measured = _unit(self._force)
        is_gravity = 0.8 < math.hypot(*self._force) / GRAVITY < 1.2
        if not is_gravity or _angle(measured, UP) > UPRIGHT:
            self._aslant_ns = self._stamp_ns
        self.upright = self._stamp_ns - self._aslant_ns >= UPRIGHT_NS
        if _angle(self._up, measured) < MAX_CONTRADICTION:
            self._agreed_ns = self._stamp_ns
            self._up = _unit(_towards(self._up, measured, is_gravity * seconds / CORRECTION))
        elif self._stamp_ns - self._agreed_ns > UPRIGHT_NS:
            self._is_known = False
        if self.upright and not self._is_known:
            self._up, self._is_known = measured, True


def _towards(vector: Triple, target: Triple, share: float) -> Triple:
    """Return the vector that a share of the way, up to 1, leads to."""
    share = min(share, 1.0)
    (x, y, z), (a, b, c) = vector, target
    return x + share * (a - x), y + share * (b - y), z + share * (c - z)


def _turned(vector: Triple, rates: Triple, seconds: float) -> Triple:
    """Return a vector that is fixed in the world, du/dt = -w x u, in axes that turn at rates (rad/s) for a time."""
    (p, q, r), (x, y, z) = rates, vector
    return x - (q * z - r * y) * seconds, y - (r * x - p * z) * seconds, z - (p * y - q * x) * seconds


def _unit(vector: Triple) -> Triple:
    x, y, z = vector
    length = math.hypot(x, y, z)
    return (x / length, y / length, z / length) if length else UP


def _angle(one: Triple, other: Triple) -> float:
    """Return the angle between two unit vectors, rad."""
    return math.acos(min(max(sum(map(operator.mul, one, other)), -1.0), 1.0))
