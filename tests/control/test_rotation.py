"""The turn rate of a rotation in place: towards the angle, within the limits, and so that it can stop there."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.rotation import PLANNED_BRAKING_FRACTION, rotation_rate
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

LIMITS = Limits.of(load_robot("chefbot"))
ANGLES = st.floats(-math.pi, math.pi, allow_subnormal=False)


@given(ANGLES)
def test_it_turns_towards_the_angle_within_the_limits(angle: float) -> None:
    rate = rotation_rate(angle, LIMITS)
    assert rate * angle >= 0.0
    assert abs(rate) <= LIMITS.angular_speed + 1e-9


@given(ANGLES)
def test_planned_braking_stops_before_the_angle(angle: float) -> None:
    rate = rotation_rate(angle, LIMITS)
    braking = rate * rate / (2.0 * PLANNED_BRAKING_FRACTION * LIMITS.angular_acceleration)
    assert braking <= abs(angle) * (1.0 + 1e-9)
