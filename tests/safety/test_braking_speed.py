"""The speed in front of an obstacle of the ultrasonic ranger lets the robot stop in time."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from chefbot.msgs.sensor_msgs import Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_acceleration
from chefbot.safety.braking_speed import ECHO_TIMEOUT_NS, safe_forward_speed

ROBOT = load_robot("chefbot")


def echo(distance: float) -> Range:
    return Range(Header.of(0, "ultrasonic"), range=distance)


@given(st.floats(0.0, 4.0), st.floats(0.0, 0.5))
def test_the_braking_distance_ends_before_the_margin(distance: float, margin: float) -> None:
    sonar = ROBOT.sensors.ultrasonic
    assert sonar is not None
    speed = safe_forward_speed(ROBOT, echo(distance), margin, 0)
    free = distance - (ROBOT.circumscribed_radius - sonar.mount.x) - margin
    assert speed >= 0.0 and speed**2 / (2.0 * max_acceleration(ROBOT)) <= max(free, 0.0)


def test_an_old_or_missing_echo_limits_nothing() -> None:
    assert safe_forward_speed(ROBOT, None, 0.04, 0) == math.inf
    assert safe_forward_speed(ROBOT, echo(0.1), 0.04, ECHO_TIMEOUT_NS) < 0.5
    assert safe_forward_speed(ROBOT, echo(0.1), 0.04, ECHO_TIMEOUT_NS + 1) == math.inf
