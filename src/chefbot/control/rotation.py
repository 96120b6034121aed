"""The turn rate of a rotation in place that ends at a given angle."""

from __future__ import annotations

import math

from chefbot.robot.motion_limits import Limits

PLANNED_BRAKING_FRACTION = 0.5
"""Fraction of the maximum acceleration that planned braking uses; the remainder is a reserve."""


def rotation_rate(angle: float, limits: Limits) -> float:
    """Return the turn rate (rad/s) with which to rotate in place by `angle` (rad), so that the base stops in time.

    The velocity limiter adds the ramp.
    """
    a = limits.angular_acceleration
    rate = min(limits.angular_speed, math.sqrt(2.0 * PLANNED_BRAKING_FRACTION * a * abs(angle)))
    w = math.copysign(rate, angle)
    return w * limits.scale(0.0, w)
