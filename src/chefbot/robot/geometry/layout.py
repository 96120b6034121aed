"""Where things are in base_link: its origin is on the floor below the axle's middle, x forward, z up."""

from __future__ import annotations

import math

from chefbot.robot.geometry.shapes import Vector
from chefbot.robot.spec import Robot

SIDES = {"left": 1.0, "right": -1.0}
CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))
CASTER_GAP = 0.0005
"""Metres between the casters and a level floor. Four rigid supports in one plane would leave it to chance
which of them carries; with this gap no wheel is lifted and odometry does not depend on the solver."""
SHAFT_CLEARANCE = 2.0
"""Diameter of the clamp's hole to that of the shaft: the gear's boss fits in."""


def motor_axis_height(robot: Robot) -> float:
    """Of the motors' middle: above the axle where the gear's shaft is off the motor's axis."""
    return robot.wheel_radius + robot.motor.shaft_offset


def plate_undersides(robot: Robot) -> list[float]:
    """Heights, lowest plate first: the base plate lies on the motor clamps, the others on tubes."""
    low = motor_axis_height(robot) + robot.motor.diameter / 2 + robot.motor_clamp.thickness
    return [low + i * (robot.plates.thickness + robot.tubes.length) for i in range(robot.plates.count)]


def plate_top(robot: Robot, number: int) -> float:
    """Upper side of a plate (1 is the lowest)."""
    return plate_undersides(robot)[number - 1] + robot.plates.thickness


def motor_bottom(robot: Robot) -> float:
    """Lowest point of the motors."""
    return motor_axis_height(robot) - robot.motor.diameter / 2


def clamp_front(robot: Robot) -> float:
    """|y| of the clamp's face towards the wheel."""
    return robot.wheels.separation / 2 - robot.wheels.width / 2 - robot.wheels.gap


def motor_front(robot: Robot) -> float:
    """|y| where the motor's body begins and its shaft leaves it."""
    return clamp_front(robot) - robot.motor_clamp.thickness


def caster_positions(robot: Robot) -> dict[str, Vector]:
    """Name of the caster to the centre of its ball."""
    z = robot.casters.radius + CASTER_GAP
    return {"front": (robot.casters.offset, 0.0, z), "back": (-robot.casters.offset, 0.0, z)}


def pole_positions(robot: Robot) -> list[tuple[float, float]]:
    """(x, y) of the four poles on each plate."""
    reach = robot.poles.reach
    return [(sx * reach, sy * reach) for sx, sy in CORNERS]


def caster_screws(robot: Robot) -> list[tuple[float, float]]:
    """(x, y) of the holes that the casters hang on, two each."""
    x, y = robot.casters.offset, robot.casters.radius / 2
    return [(sx * x, sy * y) for sx, sy in CORNERS]


def clamp_screws(robot: Robot) -> list[tuple[float, float]]:
    """(x, y) of the holes in a flange, from its middle: clear of the notch along y, of the edges along x."""
    clamp = robot.motor_clamp
    x, y = clamp.width / 2 - 2.0 * robot.plates.screw_hole, 0.3 * clamp.length
    return [(sx * x, sy * y) for sx, sy in CORNERS]


def clamp_middle(robot: Robot) -> float:
    """|y| of a flange's middle."""
    return clamp_front(robot) - robot.motor_clamp.length / 2


def notch_floor(robot: Robot) -> float:
    """|y| where the notches begin; the plate's radius where there are none."""
    notch = robot.plates.notch
    return robot.body.radius - notch.depth if notch else robot.body.radius


def notch_corner(robot: Robot) -> float:
    """|y| where the notches' ends leave the plate's circle."""
    notch = robot.plates.notch
    return math.sqrt(max(robot.body.radius**2 - (notch.length / 2) ** 2, 0.0)) if notch else robot.body.radius


def body_height(robot: Robot) -> float:
    """Floor to the top plate's upper side, metres."""
    return plate_top(robot, robot.plates.count)


def overall_height(robot: Robot) -> float:
    """Floor to the top of the payload, metres."""
    return body_height(robot) + robot.body.payload_height


def ground_clearance(robot: Robot) -> float:
    """Floor to the lowest point of the body, which wheels and casters are not of; metres."""
    return min(plate_undersides(robot)[0], motor_bottom(robot))
