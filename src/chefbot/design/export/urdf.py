"""The robot as URDF (http://wiki.ros.org/urdf/XML), for RViz, Gazebo and everyone else who reads it."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from chefbot.design.export.links import Primitive, UrdfLink, links, looks
from chefbot.design.export.mjcf import numbers
from chefbot.design.export.sdf_text import shape_tag
from chefbot.design.export.urdf_control import gazebo, ros2_control
from chefbot.design.export.urdf_frames import Frame, fixed_frames
from chefbot.robot.geometry.shapes import MassProperties, Vector
from chefbot.robot.materials import RgbaColour
from chefbot.robot.spec import Robot


def urdf(robot: Robot) -> str:
    """A URDF document without any mesh file: base_footprint, base_link, wheels, casters, sensor frames,
    then the blocks of ros2_control and Gazebo."""
    root = ET.Element("robot", name=robot.name)
    for part in (part for link in links(robot) for part in link.parts):
        _material(root, part.colour)
    ET.SubElement(root, "link", name="base_footprint")
    heavy = {link.name: link for link in links(robot)}
    hulls = {f"{hull.name}_link": hull for hull in heavy["base_link"].hulls}
    for frame in fixed_frames(robot):
        if frame.name in heavy:
            _link(root, heavy[frame.name])
        else:
            _frame(root, frame.name, hulls)
        _joint(root, frame)
    for link in heavy.values():
        if link.turns:
            _link(root, link)
            _wheel_joint(root, robot, link)
    root.append(ros2_control(robot))
    root.extend(gazebo(robot))
    root.append(for_mujoco())
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def for_mujoco() -> ET.Element:
    """MuJoCo's own words (https://mujoco.readthedocs.io/en/stable/modeling.html#urdf-extensions): it shall keep
    all links and looks, and give the casters' frames, whose mass is base_link's, no mass of its own making."""
    element = ET.Element("mujoco")
    ET.SubElement(element, "compiler", fusestatic="false", discardvisual="false", inertiafromgeom="false")
    return element


def _link(root: ET.Element, link: UrdfLink) -> None:
    """The collision is called like the link: only then does Gazebo's reader give it the link's friction."""
    element = ET.SubElement(root, "link", name=link.name)
    inertial(element, link.inertia)
    for hull in link.hulls:
        if hull.kind != "sphere":  # the casters' balls: they have frames of their own
            shaped(ET.SubElement(element, "collision", name=link.name), hull)
    for primitive, colour in (seen for part in link.parts for seen in looks(part)):
        visual = ET.SubElement(element, "visual", name=primitive.name)
        shaped(visual, primitive)
        ET.SubElement(visual, "material", name=colour_name(colour))


def _frame(root: ET.Element, name: str, hulls: dict[str, Primitive]) -> None:
    """A frame without mass and looks: those are base_link's. A caster's touches the floor."""
    element = ET.SubElement(root, "link", name=name)
    if name in hulls:
        ball = hulls[name]
        shaped(ET.SubElement(element, "collision", name=name), ball._replace(at=(0.0, 0.0, 0.0)))


def inertial(element: ET.Element, inertia: MassProperties) -> None:
    """Mass, its centre, and the tensor about it."""
    own = ET.SubElement(element, "inertial")
    ET.SubElement(own, "origin", xyz=numbers(inertia.centre), rpy="0 0 0")
    ET.SubElement(own, "mass", value=f"{inertia.mass:.9g}")
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    moments = {name: f"{value:.9g}" for name, value in zip(names, inertia.inertia, strict=True)}
    ET.SubElement(own, "inertia", moments)


def _material(root: ET.Element, colour: RgbaColour) -> None:
    name = colour_name(colour)
    if root.find(f"material[@name='{name}']") is None:
        ET.SubElement(ET.SubElement(root, "material", name=name), "color", rgba=numbers(colour))


def colour_name(colour: RgbaColour) -> str:
    """A name for the material of a colour."""
    return "colour_" + "".join(f"{round(255 * share):02x}" for share in colour)


def shaped(parent: ET.Element, solid: Primitive) -> None:
    """Origin and geometry of a visual or a collision."""
    roll, pitch, yaw = solid.rpy
    if solid.kind == "wheel":
        roll += math.pi / 2
    placed(parent, solid.at, (roll, pitch, yaw))
    size = {"radius": f"{solid.size[0]:.9g}"}
    if solid.kind == "box":
        size = {"size": numbers(solid.size)}
    elif solid.kind != "sphere":
        size["length"] = f"{solid.size[1]:.9g}"
    ET.SubElement(ET.SubElement(parent, "geometry"), shape_tag(solid), size)


def placed(parent: ET.Element, at: Vector, rpy: Vector = (0.0, 0.0, 0.0)) -> None:
    """An origin: metres; roll, pitch, yaw in radians."""
    ET.SubElement(parent, "origin", xyz=numbers(at), rpy=numbers(rpy))


def _joint(root: ET.Element, frame: Frame) -> ET.Element:
    joint = ET.SubElement(root, "joint", name=frame.joint, type="fixed")
    ET.SubElement(joint, "parent", link=frame.parent)
    ET.SubElement(joint, "child", link=frame.name)
    placed(joint, frame.at, frame.rpy)
    return joint


def _wheel_joint(root: ET.Element, robot: Robot, link: UrdfLink) -> None:
    joint = _joint(root, Frame(link.name, "base_link", link.at))
    joint.set("type", "continuous")
    ET.SubElement(joint, "axis", xyz="0 1 0")
    effort, velocity = robot.motor.stall_torque, robot.motor.no_load_speed
    ET.SubElement(joint, "limit", effort=f"{effort:.9g}", velocity=f"{velocity:.9g}")
