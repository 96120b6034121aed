"""Angles in radians, counter-clockwise (REP-103)."""

from __future__ import annotations

import math


def wrap(angle: float) -> float:
    """Normalize an angle to [-pi, pi)."""
    if -math.pi <= angle < math.pi:
        return angle  # exact, where the remainder rounds
    wrapped = (angle + math.pi) % (2.0 * math.pi) - math.pi
    return -math.pi if wrapped >= math.pi else wrapped  # the remainder may round up to the divisor
