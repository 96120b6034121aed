"""Inverse kinematics of a differential drive (Siegwart & Nourbakhsh 2004, 3.2.2)."""

from __future__ import annotations

from chefbot.robot.spec import Robot


def wheel_speeds(v: float, w: float, robot: Robot) -> tuple[float, float]:
    """Return the (left, right) wheel speeds in rad/s for a twist in m/s and rad/s, with the calibrated radii."""
    differential = w * robot.effective_wheel_separation / 2
    return (v - differential) / robot.left_wheel_radius, (v + differential) / robot.right_wheel_radius
