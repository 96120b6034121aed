"""The robot as URDF (http://wiki.ros.org/urdf/XML) for RViz, Gazebo and every other reader.

The xacro of `chefbot.design.export.urdf_xacro` is the same tree, with properties in place of numbers.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from typing import NamedTuple

from chefbot.design.export.links import Primitive, UrdfLink, links, looks
from chefbot.design.export.mjcf import numbers
from chefbot.design.export.sdf_elements import shape_tag, xml_document
from chefbot.design.export.urdf_control import gazebo, ros2_control
from chefbot.design.export.urdf_frames import Frame, fixed_frames, joint_name
from chefbot.robot.geometry.shapes import TENSOR, MassProperties, Vector
from chefbot.robot.geometry.solids import RobotPart
from chefbot.robot.materials import RgbaColour
from chefbot.robot.spec import Robot


class UrdfModel(NamedTuple):
    """What the elements of a URDF are made from.

    links: those with mass, base_link first. frames: the fixed joints, parents first. effort (N m) and velocity
    (rad/s): limits of the wheel joints.
    """

    links: Sequence[UrdfLink]
    frames: Sequence[Frame]
    effort: float
    velocity: float


def urdf(robot: Robot) -> str:
    """Return a URDF document without mesh files: links, wheels, casters, sensor frames, ros2_control, Gazebo."""
    root = ET.Element("robot", name=robot.name)
    root.extend(body_elements(urdf_model(robot), _primitive_visuals))
    root.append(ros2_control(robot))
    root.extend(gazebo(robot))
    root.append(mujoco_compiler())
    return xml_document(root)


def urdf_model(robot: Robot) -> UrdfModel:
    """Return the robot's links, frames and wheel limits."""
    return UrdfModel(links(robot), fixed_frames(robot), robot.motor.stall_torque, robot.motor.no_load_speed)


def body_elements(
    model: UrdfModel, visuals: Callable[[RobotPart], list[ET.Element]], prefix: str = ""
) -> list[ET.Element]:
    """Return materials, links and joints; `visuals` makes a part visible, `prefix` precedes link and joint names."""
    heavy = {link.name: link for link in model.links}
    balls = {f"{hull.name}_link": hull for hull in heavy["base_link"].hulls if hull.kind == "sphere"}
    found = _materials(model)
    found.append(ET.Element("link", name=f"{prefix}base_footprint"))
    for frame in model.frames:
        if frame.name in heavy:
            found.append(_link(heavy[frame.name], visuals, prefix))
        else:
            found.append(_massless(frame.name, balls, prefix))
        found.append(_joint(frame, prefix))
    for link in heavy.values():
        if link.turns:
            found += [_link(link, visuals, prefix), _wheel_joint(link, model, prefix)]
    return found


def mujoco_compiler() -> ET.Element:
    """Return the element with MuJoCo's options.

    https://mujoco.readthedocs.io/en/stable/modeling.html#urdf-extensions: it keeps all links and visuals, and
    adds no mass to the frames of the casters, whose mass is base_link's.
    """
    element = ET.Element("mujoco")
    ET.SubElement(element, "compiler", fusestatic="false", discardvisual="false", inertiafromgeom="false")
    return element


def colour_name(colour: RgbaColour) -> str:
    """Return the name of the material of a colour."""
    return "colour_" + "".join(f"{round(255 * share):02x}" for share in colour)


def visual(name: str, colour: RgbaColour, shape: list[ET.Element]) -> ET.Element:
    """Return a visual with its shape (origin and geometry) and its material."""
    element = ET.Element("visual", name=name)
    element.extend(shape)
    ET.SubElement(element, "material", name=colour_name(colour))
    return element


def origin(at: Vector, rpy: Vector = (0.0, 0.0, 0.0)) -> ET.Element:
    """Return an origin: position in metres; roll, pitch, yaw in radians."""
    return ET.Element("origin", xyz=numbers(at), rpy=numbers(rpy))


def _primitive_visuals(part: RobotPart) -> list[ET.Element]:
    return [visual(primitive.name, colour, _shape(primitive)) for primitive, colour in looks(part)]


def _materials(model: UrdfModel) -> list[ET.Element]:
    colours = dict.fromkeys(part.colour for link in model.links for part in link.parts)
    return [_material(colour) for colour in colours]


def _material(colour: RgbaColour) -> ET.Element:
    element = ET.Element("material", name=colour_name(colour))
    ET.SubElement(element, "color", rgba=numbers(colour))
    return element


def _link(link: UrdfLink, visuals: Callable[[RobotPart], list[ET.Element]], prefix: str) -> ET.Element:
    element = ET.Element("link", name=prefix + link.name)
    element.append(_inertial(link.inertia))
    for hull in link.hulls:
        if hull.kind != "sphere":  # the balls of the casters have frames of their own
            element.append(_collision(prefix + link.name, hull))
    for part in link.parts:
        element.extend(visuals(part))
    return element


def _massless(name: str, balls: dict[str, Primitive], prefix: str) -> ET.Element:
    """A frame without mass and visuals, which are base_link's; the frame of a caster touches the floor."""
    element = ET.Element("link", name=prefix + name)
    if name in balls:
        element.append(_collision(prefix + name, balls[name]._replace(at=(0.0, 0.0, 0.0))))
    return element


def _collision(name: str, hull: Primitive) -> ET.Element:
    """The name is the link's: otherwise Gazebo's reader does not apply the friction of the link."""
    element = ET.Element("collision", name=name)
    element.extend(_shape(hull))
    return element


def _inertial(inertia: MassProperties) -> ET.Element:
    element = ET.Element("inertial")
    element.append(origin(inertia.centre))
    ET.SubElement(element, "mass", value=f"{inertia.mass:.9g}")
    moments = {name: f"{value:.9g}" for name, value in zip(TENSOR, inertia.inertia, strict=True)}
    ET.SubElement(element, "inertia", moments)
    return element


def _shape(solid: Primitive) -> list[ET.Element]:
    """Origin and geometry of a visual or a collision."""
    roll, pitch, yaw = solid.rpy
    if solid.kind == "wheel":
        roll += math.pi / 2
    size = {"radius": f"{solid.size[0]:.9g}"}
    if solid.kind == "box":
        size = {"size": numbers(solid.size)}
    elif solid.kind != "sphere":
        size["length"] = f"{solid.size[1]:.9g}"
    geometry = ET.Element("geometry")
    ET.SubElement(geometry, shape_tag(solid), size)
    return [origin(solid.at, (roll, pitch, yaw)), geometry]


def _joint(frame: Frame, prefix: str) -> ET.Element:
    joint = ET.Element("joint", name=prefix + joint_name(frame.name), type="fixed")
    ET.SubElement(joint, "parent", link=prefix + frame.parent)
    ET.SubElement(joint, "child", link=prefix + frame.name)
    joint.append(origin(frame.at, frame.rpy))
    return joint


def _wheel_joint(link: UrdfLink, model: UrdfModel, prefix: str) -> ET.Element:
    joint = _joint(Frame(link.name, "base_link", link.at), prefix)
    joint.set("type", "continuous")
    ET.SubElement(joint, "axis", xyz="0 1 0")
    ET.SubElement(joint, "limit", effort=f"{model.effort:.9g}", velocity=f"{model.velocity:.9g}")
    return joint
