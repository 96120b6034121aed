"""The drive calculation of the Chefbot chapter with its arithmetic: g = 10 m/s^2 and pi = 3.14.

The arithmetic is correct, the model is not: it takes the torque at which a tyre slips for the torque that
driving needs, and loads each wheel with the weight of both. `chefbot.design.sizing.sizing` has the corrected
method.
"""

from __future__ import annotations

import math

from chefbot.design.sizing.calculation import Result, calculated
from chefbot.robot.spec import GRAVITY, Robot

CHAPTER_GRAVITY = 10.0  # m/s^2
CHAPTER_PI = 3.14
TORQUE_STEP = 5.0
"""kg cm; the chapter rounds 6.88 up to 10, which is the next multiple of five."""
SPEED_STEP = 10.0
"""rpm; the chapter rounds 74 up to 80."""
SOURCE = "Chefbot chapter: torque and RPM of the drive"
KG_CM = GRAVITY / 100.0
"""N m in one kg cm."""


def chapter_method(robot: Robot) -> list[Result]:
    """Return weight, load, torque and speed in the chapter's order; the two choices come last."""
    weight = _weight(robot)
    load = calculated("load on the driven wheels", weight.value / 2.0, "N", "W / 2", SOURCE, W=weight.value)
    torque = _torque(robot, load.value)
    speed = _speed(robot)
    return [weight, load, torque, _in_kg_cm(torque.value), speed, *_choices(torque.value, speed.value)]


def _weight(robot: Robot) -> Result:
    mass, payload = robot.body.mass_budget, robot.body.payload
    value = (mass + payload) * CHAPTER_GRAVITY
    return calculated("weight", value, "N", "(m + p) * g", SOURCE, m=mass, p=payload, g=CHAPTER_GRAVITY)


def _torque(robot: Robot, load: float) -> Result:
    friction, radius = robot.wheels.friction, robot.wheel_radius
    value = friction * load * radius
    return calculated(
        "torque of each motor", value, "N m", "mu * N * r", SOURCE, mu=friction, N=load, r=radius
    )


def _in_kg_cm(torque: float) -> Result:
    return calculated("the same in kg cm", torque / KG_CM, "kg cm", "T / k", SOURCE, T=torque, k=KG_CM)


def _speed(robot: Robot) -> Result:
    speed, diameter = robot.drive.max_speed, robot.wheels.diameter
    value = 60.0 * speed / (CHAPTER_PI * diameter)
    return calculated("speed", value, "rpm", "60 * v / (pi * D)", SOURCE, v=speed, D=diameter, pi=CHAPTER_PI)


def _choices(torque: float, speed: float) -> list[Result]:
    return [
        calculated(
            "torque to look for", round_up(torque / KG_CM, TORQUE_STEP), "kg cm", "s * ceil(T / s)",
            SOURCE, s=TORQUE_STEP, T=torque / KG_CM,
        ),
        calculated(
            "speed to look for", round_up(speed, SPEED_STEP), "rpm", "s * ceil(n / s)",
            SOURCE, s=SPEED_STEP, n=speed,
        ),
    ]  # fmt: skip


def round_up(value: float, step: float) -> float:
    """Return the smallest multiple of `step` that is not below `value`."""
    return math.ceil(value / step - 1e-9) * step
