"""The robot as a model for Gazebo Harmonic (SDF, http://sdformat.org/spec)."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from chefbot.design.export.links import Primitive, UrdfLink, links, looks
from chefbot.design.export.mjcf import BODY_FRICTION, CASTER_FRICTION
from chefbot.design.export.sdf_sensors import gz_drive, gz_sensors
from chefbot.design.export.sdf_text import coloured, document, geometry, posed, rubbing, said
from chefbot.design.export.urdf_frames import Frame, fixed_frames, joint_name
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.geometry.shapes import MassProperties
from chefbot.robot.spec import Robot

ON_ITS_SIDE = 1.5707963267948966
"""Radians about x: a cylinder's axis from z to y."""


def sdf(robot: Robot) -> str:
    """Return an SDF file with the robot's model only."""
    return document(sdf_model(robot))


def sdf_model(robot: Robot, start: SE2 = IDENTITY) -> ET.Element:
    """Return <model> with links, wheel joints, frames, sensors and drive; base_link is at `start` in the world."""
    model = ET.Element("model", name=robot.name, canonical_link="base_link")
    posed(model, (start.x, start.y, 0.0), (0.0, 0.0, start.yaw))
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
        posed(element, link.at, relative_to="base_link")
    _inertial(element, link.inertia)
    for hull in link.hulls:
        collision = _solid(element, "collision", hull)
        rubbing(collision, _friction(robot, hull))
    for primitive, colour in (seen for part in link.parts for seen in looks(part)):
        coloured(_solid(element, "visual", primitive), colour)
    return element


def _inertial(element: ET.Element, inertia: MassProperties) -> None:
    inertial = ET.SubElement(element, "inertial")
    posed(inertial, inertia.centre)
    said(inertial, "mass", inertia.mass)
    tensor = ET.SubElement(inertial, "inertia")
    for name, value in zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), inertia.inertia, strict=True):
        said(tensor, name, value)


def _solid(element: ET.Element, tag: str, solid: Primitive) -> ET.Element:
    seen = ET.SubElement(element, tag, name=solid.name)
    roll, pitch, yaw = solid.rpy
    posed(seen, solid.at, (roll + (ON_ITS_SIDE if solid.kind == "wheel" else 0.0), pitch, yaw))
    geometry(seen, solid)
    return seen


def _friction(robot: Robot, hull: Primitive) -> float:
    """Casters slide: they stand for balls that roll in their cups."""
    if hull.kind == "wheel":
        return robot.wheels.friction
    return CASTER_FRICTION if hull.kind == "sphere" else BODY_FRICTION


def _joint(model: ET.Element, robot: Robot, link: UrdfLink) -> None:
    kind = "revolute" if link.turns else "fixed"
    joint = ET.SubElement(model, "joint", name=joint_name(link.name), type=kind)
    said(joint, "parent", "base_link")
    said(joint, "child", link.name)
    if link.turns:
        axis = ET.SubElement(joint, "axis")
        said(axis, "xyz", "0 1 0")
        limit = ET.SubElement(axis, "limit")
        said(limit, "lower", "-inf")
        said(limit, "upper", "inf")
        said(limit, "effort", float(robot.motor.stall_torque))
        said(limit, "velocity", float(robot.motor.no_load_speed))


def _frames(model: ET.Element, robot: Robot) -> None:
    """What has no mass is a frame, not a link: Gazebo would give a link one kilogram."""
    known = {link.name for link in links(robot)}
    for frame in (Frame("base_footprint", "base_link", (0.0, 0.0, 0.0)), *fixed_frames(robot)):
        if frame.name not in known:
            element = ET.SubElement(model, "frame", name=frame.name, attached_to=frame.parent)
            posed(element, frame.at, frame.rpy)
