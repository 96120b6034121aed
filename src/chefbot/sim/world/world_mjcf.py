"""A world with a robot in it as one MuJoCo model (MJCF)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from chefbot.design.export.mjcf import BODY_FRICTION, FLOOR, FLOOR_FRICTION, mjcf_document, numbers, robot_xml
from chefbot.maths.se2 import SE2
from chefbot.robot.as_built import AsBuilt
from chefbot.robot.spec import Robot
from chefbot.sim.world.shapes import BOX, CAPSULE, GLASS, MIRROR, SOLID, SimulatedShape

PREFIX = "world/"
TYPES = {BOX: "box", CAPSULE: "capsule"}
GLASS_GROUP, MIRROR_GROUP = 4, 5
"""Geom groups of what light passes and of what reflects it."""
GROUPS = {SOLID: 0, GLASS: GLASS_GROUP, MIRROR: MIRROR_GROUP}


class MocapBody(NamedTuple):
    """A kinematic (mocap) body: its name, its solids in its own frame, and its pose."""

    name: str
    shapes: tuple[SimulatedShape, ...]
    pose: SE2


def world_mjcf(
    robot: Robot,
    static: Sequence[SimulatedShape],
    movers: Sequence[MocapBody],
    as_built: AsBuilt,
    start: SE2,
    slabs: Sequence[SimulatedShape] = (),
) -> str:
    """Return the MJCF text; geoms are named as their shapes, movers are mocap bodies in the given order.

    slabs: solids that are the floor of a world with holes, instead of a plane.
    """
    # Static solids are geoms of the world body: a body each would cost a third of the speed.
    walls = "\n".join(geom_xml(shape) for shape in static)
    floor = "\n".join(geom_xml(slab, FLOOR_FRICTION) for slab in slabs) or FLOOR
    moving = "\n".join(_body(mover) for mover in movers)
    return mjcf_document(robot_xml(robot, as_built, start), walls, moving, floor=floor)


def _body(mover: MocapBody) -> str:
    geoms = "".join(geom_xml(shape) for shape in mover.shapes)
    x, y, _ = mover.pose
    return f'<body name="{PREFIX}{mover.name}" mocap="true" pos="{numbers((x, y, 0.0))}">{geoms}</body>'


def geom_xml(shape: SimulatedShape, friction: float = BODY_FRICTION) -> str:
    """Return one solid as a geom; the name prefix lets a box have the same name as a part of the robot."""
    half = shape.half if shape.kind == BOX else (shape.half[0], shape.half[2])
    quaternion = numbers((math.cos(shape.yaw / 2), 0.0, 0.0, math.sin(shape.yaw / 2)))
    rgba = numbers([*(c / 255 for c in shape.colour), 1.0])
    return (
        f'<geom name="{PREFIX}{shape.name}" type="{TYPES.get(shape.kind, "cylinder")}" '
        f'pos="{numbers((shape.x, shape.y, shape.z))}" quat="{quaternion}" '
        f'size="{numbers(half)}" group="{GROUPS[shape.material]}" '
        f'friction="{friction:g} 0.005 0.0001" rgba="{rgba}"/>'
    )
