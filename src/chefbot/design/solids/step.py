"""The robot for CAD programs: exact arcs and spheres, named parts (ISO 10303, through build123d).

build123d belongs to the extra `cad`. Its lengths are millimetres, as are those of the file.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from chefbot.maths.outline import Corner, Loop, arc_between, edges
from chefbot.robot.geometry.shapes import AXES, Ball, Prism, Vector, rotation
from chefbot.robot.geometry.solids import RobotPart, link_origin, solids
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from build123d import Compound, Edge, Shape, Wire
    from build123d import Solid as CadSolid

MILLI = 1e-3


def cad_assembly(robot: Robot) -> Compound:
    """Return all parts of the robot without the payload, in base_link."""
    from build123d import Compound

    return Compound(label=robot.name, children=[_in_base(robot, part) for part in solids(robot)])


def cad_part(part: RobotPart) -> Shape:
    """Return a part in its own frame with name and colour; prisms in contact are one solid.

    A ball stays a solid of its own, because it turns.
    """
    from build123d import Color, Compound

    prisms = [_prism(solid) for solid in part.solids if isinstance(solid, Prism)]
    balls = [_ball(solid) for solid in part.solids if isinstance(solid, Ball)]
    bodies = [*([_fused(prisms)] if prisms else []), *balls]
    shape: Shape = bodies[0] if len(bodies) == 1 else Compound(bodies)
    shape.label = part.name
    shape.color = Color(*part.colour)
    return shape


def _in_base(robot: Robot, part: RobotPart) -> Shape:
    at = np.array(part.at) + np.array(link_origin(robot, part.link))
    return cad_part(part).moved(_location(rotation(part.pitch, part.yaw), at.tolist()))


def _location(turn: np.ndarray, at: Vector) -> object:
    from build123d import Location, Plane

    x, _, z = turn.T.tolist()
    return Location(Plane(origin=tuple(c / MILLI for c in at), x_dir=x, z_dir=z))


def _prism(prism: Prism) -> CadSolid:
    from build123d import Face, Solid, Vector

    face = Face(_wire(prism.outline.edge), [_wire(hole) for hole in prism.outline.holes])
    body = Solid.extrude(face, Vector(0, 0, prism.length / MILLI))
    start = np.array(prism.at) - AXES[prism.axis][:, 2] * prism.length / 2
    return body.moved(_location(AXES[prism.axis], start.tolist()))


def _ball(ball: Ball) -> CadSolid:
    from build123d import Solid

    return Solid.make_sphere(ball.radius / MILLI, angle1=-90, angle2=90).moved(_location(np.eye(3), ball.at))


def _fused(bodies: list[CadSolid]) -> Shape:
    first, *others = bodies
    return first.fuse(*others) if others else first


def _wire(loop: Loop) -> Wire:
    from build123d import Wire

    return Wire([_edge(a, b) for a, b in edges(loop)])


def _edge(a: Corner, b: Corner) -> Edge:
    """A line, or the arc through its own middle."""
    from build123d import Edge

    start, end = ((corner.x / MILLI, corner.y / MILLI) for corner in (a, b))
    if a.bulge == 0.0:
        return Edge.make_line(start, end)
    arc = arc_between(a, b)
    middle = arc.start + arc.turn / 2
    top = (arc.x + arc.radius * math.cos(middle), arc.y + arc.radius * math.sin(middle))
    return Edge.make_three_point_arc(start, tuple(c / MILLI for c in top), end)
