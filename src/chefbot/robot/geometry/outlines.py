"""Outlines of plates and motor clamps."""

from __future__ import annotations

import math

from chefbot.maths.outline import Corner, Loop, Outline, arc_bulge, circle, rectangle
from chefbot.robot.chassis import Notch
from chefbot.robot.geometry import layout
from chefbot.robot.plate_shape import RectangularPlate, RoundPlate
from chefbot.robot.spec import Robot


def middle_plate_outline(robot: Robot) -> Outline:
    """Return the outline of a plate with a hole for the wiring and a screw hole per pole."""
    edge, poles = top_plate_outline(robot)
    return Outline(edge, (_centre_hole(robot), *poles))


def top_plate_outline(robot: Robot) -> Outline:
    """Return the outline of a plate with a screw hole per pole; it is closed, so that nothing falls
    through."""
    return Outline(robot.body.plate.loop(), tuple(_screw_holes(robot, pole_holes(robot))))


def base_plate_outline(robot: Robot) -> Outline:
    """Return the outline of the lowest plate: wheel notches, screw holes of poles, casters and motor
    clamps."""
    positions = [*pole_holes(robot), *layout.caster_screws(robot), *clamp_holes(robot)]
    return Outline(_notched_edge(robot), (_centre_hole(robot), *_screw_holes(robot, positions)))


def pole_holes(robot: Robot) -> list[tuple[float, float]]:
    """Return (x, y) of the poles' screw holes, m; a single plate has none."""
    return layout.pole_positions(robot) if robot.plates.count > 1 else []


def clamp_holes(robot: Robot) -> list[tuple[float, float]]:
    """Return (x, y) of the screw holes of both motor clamps in the base plate, m."""
    middle = layout.clamp_middle(robot)
    return [(x, side * middle + y) for side in (1, -1) for x, y in layout.clamp_screws(robot)]


def flange_outline(robot: Robot) -> Outline:
    """Return the outline of the clamp's flange, which is screwed to the base plate."""
    clamp = robot.motor_clamp
    return Outline(
        rectangle(clamp.width, clamp.length), tuple(_screw_holes(robot, layout.clamp_screws(robot)))
    )


def clamp_face_outline(robot: Robot, top: float) -> Outline:
    """Return the (x, z) outline of the clamp's face, which holds the motor's front.

    z = 0 is the lower side of the flange, which lies `top` metres above the floor.
    """
    bottom = layout.motor_bottom(robot) - top
    edge = rectangle(robot.motor_clamp.width, -bottom, 0.0, bottom / 2)
    hole = circle(layout.SHAFT_CLEARANCE * robot.motor.shaft_diameter / 2, 0.0, robot.wheel_radius - top)
    return Outline(edge, (hole,))


def _centre_hole(robot: Robot) -> Loop:
    return circle(robot.plates.centre_hole / 2)


def _screw_holes(robot: Robot, positions: list[tuple[float, float]]) -> list[Loop]:
    return [circle(robot.plates.screw_hole / 2, x, y) for x, y in positions]


def _notched_edge(robot: Robot) -> Loop:
    """Return the edge of the base plate with its notches."""
    notch, plate = robot.plates.notch, robot.body.plate
    if notch is None:
        return plate.loop()
    return (
        _notched_disc(robot, notch)
        if isinstance(plate, RoundPlate)
        else _notched_rectangle(robot, plate, notch)
    )


def _notched_rectangle(robot: Robot, plate: RectangularPlate, notch: Notch) -> Loop:
    half, inner, side = notch.length / 2, layout.notch_floor(robot), plate.half_width
    right = (
        (-plate.back, -side),
        (-half, -side),
        (-half, -inner),
        (half, -inner),
        (half, -side),
        (plate.front, -side),
    )
    left = (
        (plate.front, side),
        (half, side),
        (half, inner),
        (-half, inner),
        (-half, side),
        (-plate.back, side),
    )
    return tuple(Corner(x, y) for x, y in (*right, *left))


def _notched_disc(robot: Robot, notch: Notch) -> Loop:
    """Return two arcs, front and back, joined by the three straight sides of each notch."""
    half_length, corner, inner = notch.length / 2, layout.notch_corner(robot), layout.notch_floor(robot)
    # DXF bulge of the front arc, from notch corner to notch corner; the back is its point reflection.
    bulge = arc_bulge(2.0 * math.atan2(corner, half_length))
    front = (
        Corner(half_length, -corner, bulge),
        Corner(half_length, corner),
        Corner(half_length, inner),
        Corner(-half_length, inner),
    )
    return front + tuple(Corner(-point.x, -point.y, point.bulge) for point in front)
