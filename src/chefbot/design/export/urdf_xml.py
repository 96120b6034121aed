"""URDF files from untrusted sources, as XML."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from chefbot.design.errors import DesignError
from chefbot.strict_xml import parse_xml


class UrdfError(DesignError):
    """A URDF that is not a valid description of one robot; the message names file and element."""


def parse_urdf_xml(data: bytes, where: str) -> ET.Element:
    """Return the root element of a URDF or xacro file; UrdfError, beginning with `where`, if it is not valid XML."""
    return parse_xml(data, where, UrdfError, "robot")
