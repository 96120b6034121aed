"""Kinematics of a differential drive (Siegwart & Nourbakhsh 2004, 3.2.2)."""

from __future__ import annotations

from chefbot.robot.spec import Robot


def wheel_speeds(v: float, w: float, robot: Robot) -> tuple[float, float]:
    """Return the angular velocities (left, right) of the wheels, rad/s, for a twist in m/s and rad/s.

    The calibrated radii enter here and nowhere after: a wheel of 1.02 of the drawn radius turns by 1/1.02 as fast.
    """
    differential = w * robot.effective_wheel_separation / 2
    return (v - differential) / robot.left_wheel_radius, (v + differential) / robot.right_wheel_radius


def twist_of(left: float, right: float, robot: Robot) -> tuple[float, float]:
    """Return the twist, m/s and rad/s, of angular velocities of the wheels, rad/s: the inverse of `wheel_speeds`."""
    along_left, along_right = left * robot.left_wheel_radius, right * robot.right_wheel_radius
    return (along_left + along_right) / 2, (along_right - along_left) / robot.effective_wheel_separation
