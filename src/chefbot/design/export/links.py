"""The robot as rigid links: masses, simple collision solids and visible parts.

URDF, SDF and MJCF are all generated from these links, so that they agree.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from chefbot.robot.geometry import layout
from chefbot.robot.geometry.layout import body_height, ground_clearance
from chefbot.robot.geometry.mass import link_mass_properties
from chefbot.robot.geometry.shapes import Ball, MassProperties, Prism, Solid, Vector, rotation
from chefbot.robot.geometry.solids import RobotPart, link_origin, payload, solids
from chefbot.robot.materials import RgbaColour
from chefbot.robot.plate_shape import RectangularPlate, RoundPlate
from chefbot.robot.spec import Robot

Kind = Literal["cylinder", "sphere", "box", "wheel"]


class Primitive(NamedTuple):
    """A solid that simulators and viewers draw without a mesh, in the frame of its link; metres, radians.

    size: (radius, length) of a cylinder or wheel, (radius,) of a sphere, the sides of a box. The axis of a
    cylinder is z, of a wheel y; rpy as in URDF.
    """

    name: str
    kind: Kind
    at: Vector
    size: tuple[float, ...]
    rpy: Vector = (0.0, 0.0, 0.0)


class UrdfLink(NamedTuple):
    """A rigid link: its origin in base_link, and whether it turns about its y axis (a wheel) or is fixed."""

    name: str
    at: Vector
    inertia: MassProperties
    hulls: tuple[Primitive, ...]
    parts: tuple[RobotPart, ...]
    turns: bool = False


def links(robot: Robot) -> list[UrdfLink]:
    """Return all links with mass, base_link first; its origin is on the floor below the middle of the axle."""
    return [_base(robot), _payload(robot), *(_wheel(robot, side) for side in layout.SIDES)]


def looks(part: RobotPart) -> list[tuple[Primitive, RgbaColour]]:
    """Return a part as primitives with colours, without holes and without the notches of plates."""
    turn, at = rotation(part.pitch, part.yaw), np.array(part.at)
    found = []
    for i, solid in enumerate(part.solids):
        x, y, z = (turn @ np.array(solid.at) + at).tolist()
        name = part.name if i == 0 else f"{part.name}_{i}"
        found.append((_primitive(name, solid, (x, y, z), part.pitch, part.yaw), part.colour))
    return found


def _primitive(name: str, solid: Solid, at: Vector, pitch: float, yaw: float) -> Primitive:
    if isinstance(solid, Ball):
        return Primitive(name, "sphere", at, (solid.radius,))
    edge = np.array([(corner.x, corner.y) for corner in solid.outline.edge])
    if any(corner.bulge for corner in solid.outline.edge):
        radius = float(np.hypot(*edge.T).max())
        tilt = {"x": (0.0, math.pi / 2), "y": (math.pi / 2, 0.0), "z": (0.0, 0.0)}[solid.axis]
        return Primitive(name, "cylinder", at, (radius, solid.length), (tilt[0], pitch + tilt[1], yaw))
    return _box(name, solid, edge, at, (0.0, pitch, yaw))


def _box(name: str, prism: Prism, edge: np.ndarray, at: Vector, rpy: Vector) -> Primitive:
    """The sides of a rectangle's prism; its middle may be off the outline's origin."""
    (u, v), w = np.ptp(edge, axis=0).tolist(), prism.length
    a, b = ((edge.max(axis=0) + edge.min(axis=0)) / 2).tolist()
    size, off = {
        "x": ((w, u, v), (0.0, a, b)),
        "y": ((u, w, v), (a, 0.0, b)),
        "z": ((u, v, w), (a, b, 0.0)),
    }[prism.axis]
    x, y, z = (np.array(at) + rotation(rpy[1], rpy[2]) @ np.array(off)).tolist()
    return Primitive(name, "box", (x, y, z), size, rpy)


def _base(robot: Robot) -> UrdfLink:
    """Everything except wheels and payload; its collision shape is one cylinder or box, and two balls."""
    hull = _hull(robot.body.plate, ground_clearance(robot), body_height(robot))
    casters = [
        Primitive(f"caster_{name}", "sphere", at, (robot.casters.radius,))
        for name, at in layout.caster_positions(robot).items()
    ]
    return _link(robot, "base_link", (hull, *casters))


def _hull(plate: RoundPlate | RectangularPlate, low: float, high: float) -> Primitive:
    middle, height = (low + high) / 2, high - low
    if isinstance(plate, RoundPlate):
        return Primitive("hull", "cylinder", (0.0, 0.0, middle), (plate.radius, height))
    sides = (plate.front + plate.back, 2.0 * plate.half_width, height)
    return Primitive("hull", "box", ((plate.front - plate.back) / 2.0, 0.0, middle), sides)


def _wheel(robot: Robot, side: str) -> UrdfLink:
    size = (robot.wheel_radius, robot.wheels.width)
    return _link(robot, f"wheel_{side}_link", (Primitive(f"wheel_{side}", "wheel", (0, 0, 0), size),), True)


def _link(robot: Robot, name: str, hulls: tuple[Primitive, ...], turns: bool = False) -> UrdfLink:
    parts = tuple(part for part in solids(robot) if part.link == name)
    return UrdfLink(name, link_origin(robot, name), link_mass_properties(robot, name), hulls, parts, turns)


def _payload(robot: Robot) -> UrdfLink:
    part = payload(robot)
    ((hull, _),) = looks(part)
    return UrdfLink("payload_link", link_origin(robot, part.link), part.inertia, (hull,), (part,))


def sensor_mounts(robot: Robot) -> dict[str, tuple[Vector, float, float]]:
    """Return frame name to (position in base_link, pitch, yaw) of every mounted sensor."""
    mounts = {frame: sensor.mount for frame, sensor in robot.sensors.by_frame.items()}
    return {name: ((m.x, m.y, m.z), m.pitch, m.yaw) for name, m in mounts.items()}
