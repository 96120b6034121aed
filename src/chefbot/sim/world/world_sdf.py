"""A world with a robot in it for Gazebo Harmonic: the simulator's solids as static models."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

from chefbot.design.export.mjcf import BODY_FRICTION, FLOOR_FRICTION
from chefbot.design.export.sdf import sdf_model
from chefbot.design.export.sdf_elements import (
    add_friction,
    add_material,
    add_pose,
    add_value,
    add_values,
    sdf_document,
)
from chefbot.design.export.sdf_sensors import plugin
from chefbot.robot.spec import GRAVITY, Robot
from chefbot.sim.world.floor import floor_slabs
from chefbot.sim.world.shapes import BOX, CAPSULE, GLASS, SimulatedShape
from chefbot.sim.world.world import World

STEP = 0.001
"""Physics step in seconds; Gazebo's default, at which its contacts are stable."""
SYSTEMS = ("Physics", "UserCommands", "SceneBroadcaster", "Contact", "Imu")
"""World plugins needed besides the rendered sensors."""
PREFIX = "world_"
"""Prefix of all object names: a box may have the robot's name, and Gazebo reserves some, as `ground`."""
REMARK = "People are omitted; doors are fixed at the opening given in the world file."
GLASS_ALPHA = 0.3
FLOOR_COLOUR = (0.75, 0.7, 0.6, 1.0)


def world_sdf(robot: Robot, world: World) -> str:
    """Return the SDF text: physics, systems, sun, floor, furniture and walls, and the robot at its start."""
    element = ET.Element("world", name=world.name)
    _physics(element)
    _systems(element)
    _sun(element)
    if world.holes:
        _static(element, "floor", floor_slabs(world.bounds, world.holes), FLOOR_FRICTION)
    else:
        _floor(element)
    for name, shapes in _objects(world.shapes_at_rest()).items():
        _static(element, name, shapes)
    element.append(sdf_model(robot, world.start))
    return sdf_document(element, REMARK)


def _physics(world: ET.Element) -> None:
    physics = ET.SubElement(world, "physics", name="default", type="ignored")
    add_values(physics, max_step_size=STEP, real_time_factor=1.0)
    add_value(world, "gravity", (0.0, 0.0, -GRAVITY))


def _systems(world: ET.Element) -> None:
    for system in SYSTEMS:
        suffix = "".join(f"-{letter.lower()}" if letter.isupper() else letter for letter in system)
        world.append(plugin(f"gz-sim{suffix}-system", f"gz::sim::systems::{system}"))
    sensors = plugin("gz-sim-sensors-system", "gz::sim::systems::Sensors")
    add_value(sensors, "render_engine", "ogre2")
    world.append(sensors)


def _sun(world: ET.Element) -> None:
    sun = ET.SubElement(world, "light", name="sun", type="directional")
    add_pose(sun, (0.0, 0.0, 10.0))
    add_value(sun, "cast_shadows", False)  # everything below a ceiling would be dark
    add_values(sun, diffuse=(0.8, 0.8, 0.8, 1.0), specular=(0.2, 0.2, 0.2, 1.0), direction=(-0.4, 0.2, -0.9))


def _floor(world: ET.Element) -> None:
    link = _link(world, "floor")
    for tag in ("collision", "visual"):
        solid = ET.SubElement(link, tag, name="floor")
        plane = ET.SubElement(ET.SubElement(solid, "geometry"), "plane")
        add_values(plane, normal="0 0 1", size="400 400")
        if tag == "visual":
            add_material(solid, FLOOR_COLOUR)
        else:
            add_friction(solid, FLOOR_FRICTION)


def _link(world: ET.Element, name: str) -> ET.Element:
    model = ET.SubElement(world, "model", name=PREFIX + name)
    add_value(model, "static", True)
    return ET.SubElement(model, "link", name="link")


def _objects(shapes: Iterable[SimulatedShape]) -> dict[str, list[SimulatedShape]]:
    """Group the shapes by object: shapes are named "object/part"."""
    objects: dict[str, list[SimulatedShape]] = {}
    for shape in shapes:
        objects.setdefault(shape.name.split("/")[0], []).append(shape)
    return objects


def _static(
    world: ET.Element, name: str, shapes: list[SimulatedShape], friction: float = BODY_FRICTION
) -> None:
    link = _link(world, name)
    for shape in shapes:
        part = shape.name.partition("/")[2] or "all"
        for tag in ("collision", "visual"):
            solid = ET.SubElement(link, tag, name=part)
            add_pose(solid, (shape.x, shape.y, shape.z), (0.0, 0.0, shape.yaw))
            _geometry(solid, shape)
            if tag == "collision":
                add_friction(solid, friction)
            else:
                red, green, blue = shape.colour
                alpha = GLASS_ALPHA if shape.material == GLASS else 1.0
                add_material(solid, (red / 255, green / 255, blue / 255, alpha))


def _geometry(parent: ET.Element, shape: SimulatedShape) -> None:
    tag = "box" if shape.kind == BOX else "capsule" if shape.kind == CAPSULE else "cylinder"
    solid = ET.SubElement(ET.SubElement(parent, "geometry"), tag)
    if shape.kind == BOX:
        x, y, z = shape.half
        add_value(solid, "size", (2 * x, 2 * y, 2 * z))
    else:
        add_values(solid, radius=shape.half[0], length=2 * shape.half[2])
