"""Forces of a wheeled robot: rolling resistance, slope and acceleration, and the grip of its tyres.

F = m * (a + g * sin(slope) + c * g * cos(slope)), divided by the driven wheels, then by the drive's
efficiency, once (RobotShop, Drive Motor Sizing Tutorial). Stall torques of data sheets already refer to the
gear's shaft.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.design.sizing.calculation import Result, calculated
from chefbot.robot.spec import DRIVE_EFFICIENCY, DRIVEN_WEIGHT_FRACTION, GRAVITY, ROLLING_RESISTANCE, Robot

CARPET_RESISTANCE = 0.05
"""Rolling resistance of small rubber wheels on carpet (handbook value, not measured)."""
DRIVEN_WHEELS = 2
SOURCE = "free body of the robot; RobotShop, Drive Motor Sizing Tutorial"
GRIP_SOURCE = "Coulomb friction of the driven tyres"


def requested_wheel_speed(robot: Robot) -> float:
    """Return the angular velocity of the wheels, rad/s, at the owner's maximum speed."""
    return robot.drive.max_speed / robot.wheel_radius


class Duty(NamedTuple):
    """A driving condition: rolling resistance, slope in radians, acceleration in m/s^2."""

    name: str
    rolling: float
    slope: float
    acceleration: float


CRUISE_ON_FLOOR = Duty("flat hard floor, cruising", ROLLING_RESISTANCE, 0.0, 0.0)
CRUISE_ON_CARPET = Duty("flat carpet, cruising", CARPET_RESISTANCE, 0.0, 0.0)
"""Cruising on level carpet, possible for hours."""


def climb(robot: Robot) -> Duty:
    """Return constant speed up the steepest ramp, on carpet: possible for minutes."""
    return Duty("ramp with carpet, cruising", CARPET_RESISTANCE, robot.drive.max_slope, 0.0)


def worst(robot: Robot) -> Duty:
    """Return acceleration on the steepest ramp, on carpet: possible for a second."""
    drive = robot.drive
    return Duty("ramp with carpet, speeding up", CARPET_RESISTANCE, drive.max_slope, drive.max_acceleration)


def duties(robot: Robot) -> list[Duty]:
    """Return all driving conditions, from the lightest to the heaviest."""
    start = Duty("flat hard floor, speeding up", ROLLING_RESISTANCE, 0.0, robot.drive.max_acceleration)
    return [CRUISE_ON_FLOOR, CRUISE_ON_CARPET, start, climb(robot), worst(robot)]


def force(mass: float, duty: Duty) -> Result:
    """Return the force of both driven wheels, N, for `mass` in kg."""
    value = mass * (
        duty.acceleration
        + GRAVITY * math.sin(duty.slope)
        + duty.rolling * GRAVITY * math.cos(duty.slope)
    )  # fmt: skip
    return calculated(
        f"force: {duty.name}", value, "N", "m * (a + g * sin(s) + c * g * cos(s))", SOURCE,
        m=mass, a=duty.acceleration, g=GRAVITY, s=duty.slope, c=duty.rolling,
    )  # fmt: skip


def motor_torque(robot: Robot, mass: float, duty: Duty) -> Result:
    """Return the torque of each motor at the gear shaft, N m."""
    push = force(mass, duty).value
    value = push * robot.wheel_radius / (DRIVEN_WHEELS * DRIVE_EFFICIENCY)
    return calculated(
        f"torque of each motor: {duty.name}", value, "N m", "F * r / (n * eta)", SOURCE,
        F=push, r=robot.wheel_radius, n=DRIVEN_WHEELS, eta=DRIVE_EFFICIENCY,
    )  # fmt: skip


def grip(robot: Robot, mass: float, slope: float) -> Result:
    """Return the maximum force of both driven tyres before they slip, N."""
    value = robot.traction * mass * GRAVITY * math.cos(slope)
    return calculated(
        "grip of both driven tyres", value, "N", "mu * k * m * g * cos(s)", GRIP_SOURCE,
        mu=robot.wheels.friction, k=DRIVEN_WEIGHT_FRACTION, m=mass, g=GRAVITY, s=slope,
    )  # fmt: skip


def slip_torque(robot: Robot, mass: float) -> Result:
    """Return the torque at each wheel at which it slips on a level floor, N m."""
    push = grip(robot, mass, 0.0).value
    return calculated(
        "torque at which a tyre slips", push * robot.wheel_radius / DRIVEN_WHEELS, "N m", "F * r / n",
        GRIP_SOURCE, F=push, r=robot.wheel_radius, n=DRIVEN_WHEELS,
    )  # fmt: skip
