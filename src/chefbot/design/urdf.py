"""The robot as URDF (http://wiki.ros.org/urdf/XML), for RViz, Gazebo and everyone else who reads it."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from chefbot.design.links import Link, Primitive, links, looks, sensor_mounts
from chefbot.robot.materials import Colour
from chefbot.robot.shapes import MassProperties, Vector
from chefbot.robot.spec import Robot

OPTICAL = (-math.pi / 2, 0.0, -math.pi / 2)
"""Roll, pitch, yaw from a body frame (x forward) to an optical one (z forward, x right; REP-103)."""


def urdf(robot: Robot) -> str:
    """A URDF document: base_footprint, base_link, wheels, casters and sensor frames (REP-105 names)."""
    root = ET.Element("robot", name=robot.name)
    for part in (part for link in links(robot) for part in link.parts):
        _material(root, part.colour)
    ET.SubElement(root, "link", name="base_footprint")
    _joint(root, "base_joint", "base_footprint", "base_link", (0.0, 0.0, 0.0))
    for link in links(robot):
        _link(root, robot, link)
    _sensor_frames(root, robot)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _link(root: ET.Element, robot: Robot, link: Link) -> None:
    element = ET.SubElement(root, "link", name=link.name)
    _inertial(element, link.inertia)
    casters = [hull for hull in link.hulls if hull.name.startswith("caster")]
    for hull in link.hulls:
        if hull not in casters:
            _shape(ET.SubElement(element, "collision", name=hull.name), hull)
    for primitive, colour in (seen for part in link.parts for seen in looks(part)):
        visual = ET.SubElement(element, "visual", name=primitive.name)
        _shape(visual, primitive)
        ET.SubElement(visual, "material", name=_colour_name(colour))
    if link.turns:
        _wheel_joint(root, robot, link)
    elif link.name != "base_link":
        _joint(root, link.name.replace("_link", "_joint"), "base_link", link.name, link.at)
    for caster in casters:
        _caster(root, caster)


def _caster(root: ET.Element, ball: Primitive) -> None:
    """A frame of its own, without mass and looks: those are base_link's."""
    name = f"{ball.name}_link"
    element = ET.SubElement(root, "link", name=name)
    _shape(ET.SubElement(element, "collision", name=ball.name), ball._replace(at=(0.0, 0.0, 0.0)))
    _joint(root, f"{ball.name}_joint", "base_link", name, ball.at)


def _inertial(element: ET.Element, inertia: MassProperties) -> None:
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "origin", xyz=_text(inertia.centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=f"{inertia.mass:.9g}")
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    moments = {name: f"{value:.9g}" for name, value in zip(names, inertia.inertia, strict=True)}
    ET.SubElement(inertial, "inertia", moments)


def _material(root: ET.Element, colour: Colour) -> None:
    name = _colour_name(colour)
    if root.find(f"material[@name='{name}']") is None:
        ET.SubElement(ET.SubElement(root, "material", name=name), "color", rgba=_text(colour))


def _colour_name(colour: Colour) -> str:
    return "colour_" + "".join(f"{round(255 * share):02x}" for share in colour)


def _shape(parent: ET.Element, solid: Primitive) -> None:
    roll, pitch, yaw = solid.rpy
    if solid.kind == "wheel":
        roll += math.pi / 2
    ET.SubElement(parent, "origin", xyz=_text(solid.at), rpy=_text((roll, pitch, yaw)))
    geometry = ET.SubElement(parent, "geometry")
    if solid.kind == "sphere":
        ET.SubElement(geometry, "sphere", radius=f"{solid.size[0]:.9g}")
    elif solid.kind == "box":
        ET.SubElement(geometry, "box", size=_text(solid.size))
    else:
        ET.SubElement(geometry, "cylinder", radius=f"{solid.size[0]:.9g}", length=f"{solid.size[1]:.9g}")


def _joint(
    root: ET.Element, name: str, parent: str, child: str, at: Vector, rpy: Vector = (0.0, 0.0, 0.0)
) -> ET.Element:
    joint = ET.SubElement(root, "joint", name=name, type="fixed")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=_text(at), rpy=_text(rpy))
    return joint


def _wheel_joint(root: ET.Element, robot: Robot, link: Link) -> None:
    joint = _joint(root, link.name.replace("_link", "_joint"), "base_link", link.name, link.at)
    joint.set("type", "continuous")
    ET.SubElement(joint, "axis", xyz="0 1 0")
    effort, velocity = robot.motor.stall_torque, robot.motor.no_load_speed
    ET.SubElement(joint, "limit", effort=f"{effort:.9g}", velocity=f"{velocity:.9g}")


def _sensor_frames(root: ET.Element, robot: Robot) -> None:
    for name, (at, pitch, yaw) in sensor_mounts(robot).items():
        ET.SubElement(root, "link", name=name)
        _joint(root, f"{name.removesuffix('_link')}_joint", "base_link", name, at, (0.0, pitch, yaw))
    if robot.sensors.depth_camera is not None:
        for name, parent, rpy in (
            ("camera_depth_frame", "camera_link", (0.0, 0.0, 0.0)),
            ("camera_depth_optical_frame", "camera_depth_frame", OPTICAL),
        ):
            ET.SubElement(root, "link", name=name)
            _joint(root, name.replace("_frame", "_joint"), parent, name, (0.0, 0.0, 0.0), rpy)


def _text(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
