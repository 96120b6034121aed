"""The outlines of plates and motor clamps."""

from __future__ import annotations

import math

from chefbot.maths.outline import Corner, Loop, Outline, arc_bulge, circle, rectangle
from chefbot.robot.geometry import layout
from chefbot.robot.spec import Robot


def middle_plate_outline(robot: Robot) -> Outline:
    """A disc with a hole for the wiring and one screw hole for each pole."""
    disc, poles = top_plate_outline(robot)
    return Outline(disc, (_centre_hole(robot), *poles))


def top_plate_outline(robot: Robot) -> Outline:
    """A disc with one screw hole for each pole: nothing falls through it."""
    return Outline(circle(robot.body.radius), tuple(_screw_holes(robot, pole_holes(robot))))


def base_plate_outline(robot: Robot) -> Outline:
    """The lowest plate: besides, the notches of the wheels and the screw holes of casters and motor clamps."""
    places = [*pole_holes(robot), *layout.caster_screws(robot), *clamp_holes(robot)]
    return Outline(_notched_disc(robot), (_centre_hole(robot), *_screw_holes(robot, places)))


def pole_holes(robot: Robot) -> list[tuple[float, float]]:
    """Screws of the poles; a single plate has none."""
    return layout.pole_positions(robot) if robot.plates.count > 1 else []


def clamp_holes(robot: Robot) -> list[tuple[float, float]]:
    """Screws of both motor clamps in the base plate."""
    middle = layout.clamp_middle(robot)
    return [(x, side * middle + y) for side in (1, -1) for x, y in layout.clamp_screws(robot)]


def flange_outline(robot: Robot) -> Outline:
    """The part of the clamp that is screwed to the base plate."""
    clamp = robot.motor_clamp
    return Outline(
        rectangle(clamp.width, clamp.length), tuple(_screw_holes(robot, layout.clamp_screws(robot)))
    )


def clamp_face_outline(robot: Robot, top: float) -> Outline:
    """(x, z) of the part that holds the motor's front, z = 0 at the flange's lower side, `top` above the floor."""
    low = layout.motor_bottom(robot) - top
    edge = rectangle(robot.motor_clamp.width, -low, 0.0, low / 2)
    hole = circle(layout.SHAFT_CLEARANCE * robot.motor.shaft_diameter / 2, 0.0, robot.wheel_radius - top)
    return Outline(edge, (hole,))


def _centre_hole(robot: Robot) -> Loop:
    return circle(robot.plates.centre_hole / 2)


def _screw_holes(robot: Robot, places: list[tuple[float, float]]) -> list[Loop]:
    return [circle(robot.plates.screw_hole / 2, x, y) for x, y in places]


def _notched_disc(robot: Robot) -> Loop:
    """Two arcs, front and back, joined by the notches' three straight sides."""
    notch = robot.plates.notch
    if notch is None:
        return circle(robot.body.radius)
    half, rim, floor = notch.length / 2, layout.notch_corner(robot), layout.notch_floor(robot)
    bulge = arc_bulge(2.0 * math.atan2(rim, half))
    front = (Corner(half, -rim, bulge), Corner(half, rim), Corner(half, floor), Corner(-half, floor))
    return front + tuple(Corner(-c.x, -c.y, c.bulge) for c in front)
