"""Twist of a differential drive and speeds of its wheels (Siegwart & Nourbakhsh 2004, 3.2.2)."""

from __future__ import annotations

from chefbot.robot.spec import Robot


def wheel_speeds(v: float, w: float, robot: Robot) -> tuple[float, float]:
    """(left, right) wheel speed in rad/s for a twist in m/s and rad/s."""
    rim = w * robot.wheels.separation / 2
    return (v - rim) / robot.wheel_radius, (v + rim) / robot.wheel_radius


def twist(left: float, right: float, robot: Robot) -> tuple[float, float]:
    """(v, w) in m/s and rad/s for wheel speeds in rad/s."""
    v = (left + right) / 2 * robot.wheel_radius
    return v, (right - left) * robot.wheel_radius / robot.wheels.separation
