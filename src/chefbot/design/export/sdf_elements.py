"""The elements that SDF files are made of (http://sdformat.org/spec)."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from chefbot.design.export.links import Primitive
from chefbot.design.export.mjcf import numbers
from chefbot.robot.geometry.shapes import Vector
from chefbot.robot.materials import RgbaColour

VERSION = "1.9"
"""Version of SDF that Gazebo Harmonic and Garden and Debian 12's libsdformat read."""


def add_value(parent: ET.Element, tag: str, value: object, **attributes: str) -> ET.Element:
    """Add `<tag>value</tag>`; numbers have nine digits, booleans are true or false."""
    element = ET.SubElement(parent, tag, attributes)
    element.text = xml_text(value)
    return element


def add_values(parent: ET.Element, /, **values: object) -> None:
    """Add one element for each tag, in the given order."""
    for tag, value in values.items():
        add_value(parent, tag, value)


def xml_text(value: object) -> str:
    """Return a value as SDF text."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.9g}"
    return numbers(value) if isinstance(value, tuple) else str(value)


def add_pose(parent: ET.Element, at: Vector, rpy: Vector = (0.0, 0.0, 0.0), relative_to: str = "") -> None:
    """Add a pose: metres, and radians about the fixed axes x, y, z."""
    attributes = {"relative_to": relative_to} if relative_to else {}
    add_value(parent, "pose", (*at, *rpy), **attributes)


def add_geometry(parent: ET.Element, solid: Primitive) -> None:
    """Add shape and size; a wheel is a cylinder, turned by its pose."""
    shape = ET.SubElement(ET.SubElement(parent, "geometry"), shape_tag(solid))
    if solid.kind == "box":
        add_value(shape, "size", tuple(float(side) for side in solid.size))
    else:
        add_value(shape, "radius", float(solid.size[0]))
    if shape.tag == "cylinder":
        add_value(shape, "length", float(solid.size[1]))


def shape_tag(solid: Primitive) -> str:
    """Return the tag of a shape; `cylinder` for a wheel too."""
    return "cylinder" if solid.kind == "wheel" else solid.kind


def add_material(parent: ET.Element, colour: RgbaColour) -> None:
    """Add a material without specular reflection."""
    material = ET.SubElement(parent, "material")
    add_values(material, ambient=tuple(colour), diffuse=tuple(colour))


def add_friction(parent: ET.Element, friction: float) -> None:
    """Add Coulomb friction, the same along and across."""
    ode = ET.SubElement(ET.SubElement(ET.SubElement(parent, "surface"), "friction"), "ode")
    add_values(ode, mu=float(friction), mu2=float(friction))


def sdf_document(child: ET.Element, comment: str = "") -> str:
    """Return the file that contains a model or a world."""
    root = ET.Element("sdf", version=VERSION)
    if comment:
        root.append(ET.Comment(f" {comment} "))
    root.append(child)
    return xml_document(root)


def xml_document(root: ET.Element) -> str:
    """Return the indented text of a file with this outermost element."""
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
