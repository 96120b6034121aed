"""A world file as text."""

from __future__ import annotations

from chefbot.buildings.world_file import WorldSpec
from chefbot.config_text import plain_sections, yaml_text


def world_text(spec: WorldSpec, comment: str) -> str:
    """Return the YAML text of a world file, one element a line, without values that are the default.

    comment: text of its first lines.
    """
    return yaml_text(plain_sections(spec), comment)
