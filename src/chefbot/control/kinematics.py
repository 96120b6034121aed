"""Twist of a differential drive and speeds of its wheels (Siegwart & Nourbakhsh 2004, 3.2.2)."""

from __future__ import annotations

from chefbot.robot.spec import Robot


def wheel_speeds(v: float, w: float, robot: Robot) -> tuple[float, float]:
    """(left, right) wheel speed in rad/s for a twist in m/s and rad/s, on the wheels as they were measured."""
    rim = w * robot.turning_separation / 2
    return (v - rim) / robot.left_radius, (v + rim) / robot.right_radius


def twist(left: float, right: float, robot: Robot) -> tuple[float, float]:
    """(v, w) in m/s and rad/s for wheel speeds in rad/s."""
    left_rim, right_rim = left * robot.left_radius, right * robot.right_radius
    return (left_rim + right_rim) / 2, (right_rim - left_rim) / robot.turning_separation
