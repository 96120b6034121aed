"""Speed limit in front of an obstacle that the ultrasonic ranger measures."""

from __future__ import annotations

import math

from chefbot.msgs.sensor_msgs import Range
from chefbot.robot.motion_limits import max_acceleration
from chefbot.robot.spec import Robot

ECHO_TIMEOUT_NS = 300_000_000
"""Maximum age of an echo of the ultrasonic ranger, ns."""
PLANNED_BRAKING_FRACTION = 0.6
"""Fraction of the maximum acceleration that braking before the ultrasonic ranger's obstacle plans with."""


def safe_forward_speed(robot: Robot, echo: Range | None, margin: float, now_ns: int) -> float:
    """Return the forward speed (m/s) from which the robot stops `margin` metres before the echo's obstacle.

    The depth camera does not see what is that near. Infinite without an ultrasonic ranger or a recent echo.
    """
    sonar = robot.sensors.ultrasonic
    if sonar is None or echo is None or now_ns - echo.header.stamp.ns > ECHO_TIMEOUT_NS:
        return math.inf
    free_distance = max(0.0, echo.range - (robot.footprint.front - sonar.mount.x) - margin)
    return math.sqrt(2.0 * PLANNED_BRAKING_FRACTION * max_acceleration(robot) * free_distance)
