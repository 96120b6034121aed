"""A world file as text."""

from __future__ import annotations

from typing import Any

import yaml

from chefbot.buildings.world_file import WorldSpec
from chefbot.config import to_plain


def world_text(spec: WorldSpec, remark: str) -> str:
    """Return the YAML text of a world file, one element a line, without values that are the default.

    remark: a comment for its first lines.
    """
    comment = "".join(f"# {line}\n" for line in remark.splitlines())
    return comment + "".join(_section(key, value) for key, value in to_plain(spec).items())


def _section(key: str, value: Any) -> str:
    if isinstance(value, list):
        return f"{key}:\n" + "".join(f"  - {_flow(one)}\n" for one in value)
    if isinstance(value, dict):
        return f"{key}:\n" + "".join(f"  {name}: {_flow(one)}\n" for name, one in value.items())
    return f"{key}: {_flow(value)}\n"


def _flow(value: Any) -> str:
    """Return a value on one line."""
    text: str = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=float("inf"))
    return text.removesuffix("...\n").strip()
