"""A parser for XML from untrusted sources: no entities, limited depth and size."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from xml.parsers import expat

from chefbot.errors import ChefbotError

MAX_DEPTH = 100
"""Maximum nesting of elements; a URDF needs ten."""
MAX_PARTS = 200_000
"""Maximum number of elements and attributes: each takes a hundred times the memory of its text."""


def parse_xml(data: bytes, where: str, error: type[ChefbotError], subject: str) -> ET.Element:
    """Return the root element of an XML document.

    `where` names it in errors, and `subject` what it should be, as "robot". `error` is raised for broken XML, for a
    DOCTYPE (entities can grow without bound) and for elements nested too deeply.
    """
    scout, depth, parts = expat.ParserCreate(), 0, 0

    def start(_tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, parts
        depth, parts = depth + 1, parts + 1 + len(attributes)
        if parts > MAX_PARTS:
            raise error(
                f"{where}: has more than {MAX_PARTS} elements and attributes; that is not a {subject}"
            )
        if depth > MAX_DEPTH:
            raise error(f"{where}: elements are nested more than {MAX_DEPTH} deep; that is not a {subject}")

    def end(_tag: str) -> None:
        nonlocal depth
        depth -= 1

    def doctype(*_: object) -> None:
        raise error(f"{where}: has a DOCTYPE, which can define entities that grow without bound; remove it")

    scout.StartElementHandler, scout.EndElementHandler, scout.StartDoctypeDeclHandler = start, end, doctype
    try:
        scout.Parse(data, True)
        return ET.fromstring(data)
    except (expat.ExpatError, ET.ParseError, ValueError, LookupError) as cause:
        raise error(f"{where}: is not valid XML: {cause}") from None
