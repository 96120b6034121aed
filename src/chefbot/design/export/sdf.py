"""The robot as a model for Gazebo Harmonic (SDF, http://sdformat.org/spec)."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from chefbot.design.export.links import Primitive, UrdfLink, links, looks
from chefbot.design.export.mjcf import BODY_FRICTION, CASTER_FRICTION
from chefbot.design.export.sdf_elements import (
    add_friction,
    add_geometry,
    add_material,
    add_pose,
    add_value,
    add_values,
    sdf_document,
)
from chefbot.design.export.sdf_sensors import gz_drive, gz_sensors
from chefbot.design.export.urdf_frames import Frame, fixed_frames, joint_name
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.geometry.shapes import TENSOR, MassProperties
from chefbot.robot.spec import Robot

CYLINDER_ROLL = 1.5707963267948966
"""Radians about x: a cylinder's axis from z to y."""


def sdf(robot: Robot) -> str:
    """Return an SDF file with the robot's model only."""
    return sdf_document(sdf_model(robot))


def sdf_model(robot: Robot, start: SE2 = IDENTITY) -> ET.Element:
    """Return <model> with links, wheel joints, frames, sensors and drive; base_link is at `start` in the world."""
    model = ET.Element("model", name=robot.name, canonical_link="base_link")
    add_pose(model, (start.x, start.y, 0.0), (0.0, 0.0, start.yaw))
    for link in links(robot):
        element = _link(model, robot, link)
        if link.name == "base_link":
            for frame, sensor in gz_sensors(robot).items():
                pose = ET.Element("pose", relative_to=frame)
                pose.text = "0 0 0 0 0 0"
                sensor.insert(0, pose)
                element.append(sensor)
        else:
            _joint(model, robot, link)
    _frames(model, robot)
    model.extend(gz_drive(robot))
    return model


def _link(model: ET.Element, robot: Robot, link: UrdfLink) -> ET.Element:
    element = ET.SubElement(model, "link", name=link.name)
    if link.name != "base_link":
        add_pose(element, link.at, relative_to="base_link")
    _inertial(element, link.inertia)
    for hull in link.hulls:
        collision = _solid(element, "collision", hull)
        add_friction(collision, _friction(robot, hull))
    for primitive, colour in (seen for part in link.parts for seen in looks(part)):
        add_material(_solid(element, "visual", primitive), colour)
    return element


def _inertial(element: ET.Element, inertia: MassProperties) -> None:
    inertial = ET.SubElement(element, "inertial")
    add_pose(inertial, inertia.centre)
    add_value(inertial, "mass", inertia.mass)
    tensor = ET.SubElement(inertial, "inertia")
    add_values(tensor, **dict(zip(TENSOR, inertia.inertia, strict=True)))


def _solid(element: ET.Element, tag: str, solid: Primitive) -> ET.Element:
    seen = ET.SubElement(element, tag, name=solid.name)
    roll, pitch, yaw = solid.rpy
    add_pose(seen, solid.at, (roll + (CYLINDER_ROLL if solid.kind == "wheel" else 0.0), pitch, yaw))
    add_geometry(seen, solid)
    return seen


def _friction(robot: Robot, hull: Primitive) -> float:
    """Casters slide with low friction, as balls that roll in their cups."""
    if hull.kind == "wheel":
        return robot.wheels.friction
    return CASTER_FRICTION if hull.kind == "sphere" else BODY_FRICTION


def _joint(model: ET.Element, robot: Robot, link: UrdfLink) -> None:
    kind = "revolute" if link.turns else "fixed"
    joint = ET.SubElement(model, "joint", name=joint_name(link.name), type=kind)
    add_values(joint, parent="base_link", child=link.name)
    if link.turns:
        axis = ET.SubElement(joint, "axis")
        add_value(axis, "xyz", "0 1 0")
        limit = ET.SubElement(axis, "limit")
        motor = robot.motor
        effort, velocity = float(motor.stall_torque), float(motor.no_load_speed)
        add_values(limit, lower="-inf", upper="inf", effort=effort, velocity=velocity)


def _frames(model: ET.Element, robot: Robot) -> None:
    """Frames without mass; as links they would have one kilogram in Gazebo."""
    known = {link.name for link in links(robot)}
    for frame in (Frame("base_footprint", "base_link", (0.0, 0.0, 0.0)), *fixed_frames(robot)):
        if frame.name not in known:
            element = ET.SubElement(model, "frame", name=frame.name, attached_to=frame.parent)
            add_pose(element, frame.at, frame.rpy)
