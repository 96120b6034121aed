"""Tipping of the robot with its payload: braking, on a ramp, in a turn.

The force of weight and inertia through the centre of mass must intersect the floor inside the polygon of
wheels and casters (zero-moment point: Vukobratovic and Borovac, 2004). Per metre of height the point of
intersection moves by the horizontal acceleration over the vertical one; the limit is its distance to the edge
of the polygon. Suspension and sloshing are neglected.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.design.sizing.calculation import Result, calculated
from chefbot.robot.geometry.layout import body_height, overall_height
from chefbot.robot.geometry.mass import robot_mass_properties
from chefbot.robot.spec import DRIVEN_WEIGHT_FRACTION, GRAVITY, Robot

SAFETY = 1.25
"""Tyres cannot brake harder than they grip, so the worst case is a bound already. This is for a payload beside its
place: where it is a third of the mass, it may stand off by 0.6 of the way from the foot to the edge."""
SOURCE = "zero-moment point (Vukobratovic and Borovac, 2004)"
Point = tuple[float, float]


class Load(NamedTuple):
    """The robot with its payload: mass in kg, centre in base_link in metres."""

    mass: float
    x: float
    y: float
    z: float


def loaded(robot: Robot) -> Load:
    """Return the load from the solids; the centre of the payload is half its height above the top plate."""
    own, payload = robot_mass_properties(robot), robot.body.payload
    mass = own.mass + payload
    height = (body_height(robot) + overall_height(robot)) / 2.0
    x, y, z = own.centre
    return Load(mass, own.mass * x / mass, own.mass * y / mass, (own.mass * z + payload * height) / mass)


def support(robot: Robot) -> list[Point]:
    """Return the points of contact with the floor in base_link, counter-clockwise from the front, m."""
    reach, half = robot.casters.offset, robot.wheels.separation / 2.0
    return [(reach, 0.0), (0.0, half), (-reach, 0.0), (0.0, -half)]


def room(polygon: list[Point], point: Point, direction: Point) -> float:
    """Return the distance from `point` along the unit vector `direction` to the edge of a polygon, m.

    The polygon is convex and counter-clockwise. Negative if the point is outside.
    """
    distances = []
    for start, end in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        normal = (end[1] - start[1], start[0] - end[0])
        inside = normal[0] * (start[0] - point[0]) + normal[1] * (start[1] - point[1])
        towards = normal[0] * direction[0] + normal[1] * direction[1]
        if inside < 0.0:
            return inside / math.hypot(*normal)
        if towards > 0.0:
            distances.append(inside / towards)
    return min(distances)


def nearest_edge(polygon: list[Point], point: Point) -> float:
    """Return the distance to the nearest edge, m; negative outside."""
    edges = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    distances = []
    for start, end in edges:
        length = math.hypot(end[0] - start[0], end[1] - start[1])
        normal = ((end[1] - start[1]) / length, (start[0] - end[0]) / length)
        distances.append(normal[0] * (start[0] - point[0]) + normal[1] * (start[1] - point[1]))
    return min(distances)


class Tipping(NamedTuple):
    """A way of tipping: limit and expected value of horizontal over vertical acceleration."""

    name: str
    limit: Result
    expected: Result


def tipping(robot: Robot, load: Load) -> list[Tipping]:
    """Return every case: braking on the flat and downhill, standing across a ramp, turning."""
    forward, sideways, any_way = _rooms(robot, load)
    return [
        Tipping("braking as hard as the tyres grip", _limit(forward, load), _hard_braking(robot)),
        Tipping("braking down the ramp", _limit(forward, load), _braking_downhill(robot)),
        Tipping("standing on the ramp, any way round", _limit(any_way, load), _standing(robot)),
        Tipping("turning at full speed", _limit(sideways, load), _turning(robot)),
    ]


def _rooms(robot: Robot, load: Load) -> tuple[float, float, float]:
    """Along the drive, across it, and to the nearest edge, metres."""
    polygon, foot = support(robot), (load.x, load.y)
    forward = min(room(polygon, foot, (1.0, 0.0)), room(polygon, foot, (-1.0, 0.0)))
    sideways = min(room(polygon, foot, (0.0, 1.0)), room(polygon, foot, (0.0, -1.0)))
    return forward, sideways, nearest_edge(polygon, foot)


def _limit(distance: float, load: Load) -> Result:
    return calculated("bears", distance / load.z, "g", "d / h", SOURCE, d=distance, h=load.z)


def _hard_braking(robot: Robot) -> Result:
    friction = robot.wheels.friction
    return calculated("meets", robot.traction, "g", "mu * k", SOURCE, mu=friction, k=DRIVEN_WEIGHT_FRACTION)


def _braking_downhill(robot: Robot) -> Result:
    slope, braking = robot.drive.max_slope, robot.drive.max_acceleration
    value = math.tan(slope) + braking / (GRAVITY * math.cos(slope))
    return calculated("meets", value, "g", "tan(s) + a / (g * cos(s))", SOURCE, s=slope, a=braking, g=GRAVITY)


def _standing(robot: Robot) -> Result:
    slope = robot.drive.max_slope
    return calculated("meets", math.tan(slope), "g", "tan(s)", SOURCE, s=slope)


def _turning(robot: Robot) -> Result:
    speed, turn = robot.drive.max_speed, robot.drive.max_turn
    return calculated("meets", speed * turn / GRAVITY, "g", "v * w / g", SOURCE, v=speed, w=turn, g=GRAVITY)
