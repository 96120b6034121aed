"""The robot as URDF (http://wiki.ros.org/urdf/XML), for RViz, Gazebo and everyone else who reads it."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from chefbot.design.links import Inertia, Link, Solid, Vector, links, sensor_mounts
from chefbot.robot.spec import Robot

OPTICAL = (-math.pi / 2, 0.0, -math.pi / 2)
"""Roll, pitch, yaw from a body frame (x forward) to an optical one (z forward, x right; REP-103)."""
COLOURS = {"plate": "0.85 0.7 0.45 1", "black": "0.15 0.15 0.15 1", "steel": "0.6 0.6 0.65 1"}


def urdf(robot: Robot) -> str:
    """A URDF document: base_footprint, base_link, wheels, casters and sensor frames (REP-105 names)."""
    root = ET.Element("robot", name=robot.name)
    for name, rgba in COLOURS.items():
        ET.SubElement(ET.SubElement(root, "material", name=name), "color", rgba=rgba)
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
    casters = [solid for solid in link.solids if solid.name.startswith("caster")]
    for solid in link.solids:
        if solid not in casters:
            _solid(element, solid)
    if link.turns:
        _wheel_joint(root, robot, link)
    elif link.name != "base_link":
        _joint(root, link.name.replace("_link", "_joint"), "base_link", link.name, link.at)
    for caster in casters:
        _caster(root, caster)


def _caster(root: ET.Element, solid: Solid) -> None:
    """A frame of its own, without mass: that is in base_link already."""
    name = f"{solid.name}_link"
    element = ET.SubElement(root, "link", name=name)
    _solid(element, solid._replace(at=(0.0, 0.0, 0.0)))
    _joint(root, f"{solid.name}_joint", "base_link", name, solid.at)


def _inertial(element: ET.Element, inertia: Inertia) -> None:
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "origin", xyz=_text(inertia.centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=f"{inertia.mass:.9g}")
    ixx, iyy, izz = (f"{moment:.9g}" for moment in inertia.moments)
    ET.SubElement(inertial, "inertia", ixx=ixx, ixy="0", ixz="0", iyy=iyy, iyz="0", izz=izz)


def _solid(element: ET.Element, solid: Solid) -> None:
    """The hull collides, the rest is seen; wheels, casters and payload are both."""
    seen = solid.name != "hull"
    if solid.hull:
        _shape(ET.SubElement(element, "collision", name=solid.name), solid)
    if seen:
        visual = ET.SubElement(element, "visual", name=solid.name)
        _shape(visual, solid)
        ET.SubElement(visual, "material", name=_material(solid))


def _material(solid: Solid) -> str:
    if solid.kind == "wheel":
        return "black"
    return "plate" if solid.name.startswith("plate") else "steel"


def _shape(parent: ET.Element, solid: Solid) -> None:
    roll = math.pi / 2 if solid.kind == "wheel" else 0.0
    ET.SubElement(parent, "origin", xyz=_text(solid.at), rpy=_text((roll, 0.0, 0.0)))
    geometry = ET.SubElement(parent, "geometry")
    if solid.kind == "sphere":
        ET.SubElement(geometry, "sphere", radius=f"{solid.size[0]:.9g}")
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
