"""Positions of parts in base_link: origin on the floor below the middle of the axle, x forward, z up."""

from __future__ import annotations

from chefbot.robot.geometry.shapes import Vector
from chefbot.robot.spec import Robot

SIDES = {"left": 1.0, "right": -1.0}
CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))
CASTER_GAP = 0.0005
"""Metres between the casters and a level floor. With four rigid supports in one plane, numerical noise would
decide which of them carries load; with this gap no wheel is lifted and odometry does not depend on the
solver."""
SHAFT_CLEARANCE = 2.0
"""Ratio of the clamp's hole diameter to the shaft diameter, so that the gearbox boss fits in."""


def motor_axis_height(robot: Robot) -> float:
    """Return the height of the motor axis, m: above the axle if the gearbox shaft is offset from it."""
    return robot.wheel_radius + robot.motor.shaft_offset


def plate_undersides(robot: Robot) -> list[float]:
    """Return the heights of the plates' lower sides, m, lowest plate first.

    The base plate lies on the motor clamps, the others on tubes.
    """
    base = motor_axis_height(robot) + robot.motor.diameter / 2 + robot.motor_clamp.thickness
    return [base + i * (robot.plates.thickness + robot.tubes.length) for i in range(robot.plates.count)]


def plate_top(robot: Robot, number: int) -> float:
    """Return the height of a plate's upper side, m; plate 1 is the lowest."""
    return plate_undersides(robot)[number - 1] + robot.plates.thickness


def motor_bottom(robot: Robot) -> float:
    """Return the height of the lowest point of the motors, m."""
    return motor_axis_height(robot) - robot.motor.diameter / 2


def clamp_front(robot: Robot) -> float:
    """Return |y| of the clamp face towards the wheel, m."""
    return robot.wheels.inner_face - robot.wheels.gap


def motor_front(robot: Robot) -> float:
    """Return |y| of the motor body's front, where the shaft begins, m."""
    return clamp_front(robot) - robot.motor_clamp.thickness


def caster_positions(robot: Robot) -> dict[str, Vector]:
    """Return the centre of each caster ball by the caster's name, m."""
    z = robot.casters.radius + CASTER_GAP
    return {"front": (robot.casters.offset, 0.0, z), "back": (-robot.casters.offset, 0.0, z)}


def pole_positions(robot: Robot) -> list[tuple[float, float]]:
    """Return (x, y) of the four poles on each plate, m."""
    reach = robot.poles.reach
    return [(sx * reach, sy * reach) for sx, sy in CORNERS]


def caster_screws(robot: Robot) -> list[tuple[float, float]]:
    """Return (x, y) of the screw holes of the casters, two each, m."""
    x, y = robot.casters.offset, robot.casters.radius / 2
    return [(sx * x, sy * y) for sx, sy in CORNERS]


def clamp_screws(robot: Robot) -> list[tuple[float, float]]:
    """Return (x, y) of the flange's screw holes from its middle, m.

    They are clear of the notch along y and of the flange's edges along x.
    """
    clamp = robot.motor_clamp
    x, y = clamp.width / 2 - 2.0 * robot.plates.screw_hole, 0.3 * clamp.length
    return [(sx * x, sy * y) for sx, sy in CORNERS]


def clamp_middle(robot: Robot) -> float:
    """Return |y| of the middle of a flange, m."""
    return clamp_front(robot) - robot.motor_clamp.length / 2


def wheel_recess(robot: Robot) -> float:
    """Return the distance of the wheels' inner faces from the plates' edge at the axle, m."""
    return robot.body.plate.half_width - robot.wheels.inner_face


def notch_floor(robot: Robot) -> float:
    """Return |y| of the notches' inner edge, m; that of the plate's edge at the axle if there are no notches."""
    notch, edge = robot.plates.notch, robot.body.plate.half_width
    return edge - notch.depth if notch else edge


def notch_corner(robot: Robot) -> float:
    """Return |y| where the ends of the notches meet the plate's edge, m."""
    notch, plate = robot.plates.notch, robot.body.plate
    return plate.half_width_at(notch.length / 2) if notch else plate.half_width


def body_height(robot: Robot) -> float:
    """Return the height of the top plate's upper side above the floor, m."""
    return plate_top(robot, robot.plates.count)


def overall_height(robot: Robot) -> float:
    """Return the height of the payload's top above the floor, m."""
    return body_height(robot) + robot.body.payload_height


def ground_clearance(robot: Robot) -> float:
    """Return the height of the lowest point of the body above the floor, without wheels and casters, m."""
    return min(plate_undersides(robot)[0], motor_bottom(robot))
