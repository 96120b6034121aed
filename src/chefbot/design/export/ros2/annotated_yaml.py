"""Parameter values with the reason for each, and YAML files made of them."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from chefbot.design.errors import DesignError
from chefbot.strict_yaml import load_strict

Plain: TypeAlias = bool | int | float | str | list[str] | list[float] | list[bool]
"""The types of ROS 2 parameters; an empty list has no type."""
WIDTH = 110
TEMPLATES = Path(__file__).parent / "packages" / "chefbot_bringup" / "config"
"""Parameter files with the values that do not depend on the robot; the others are empty."""


class Explained(NamedTuple):
    """A parameter's value and the reason for it: formula and numbers."""

    value: Plain
    reason: str = ""


Tree: TypeAlias = Mapping[str, "Explained | Plain | Tree"]
PlainTree: TypeAlias = dict[str, "Plain | PlainTree"]


def plain_values(tree: Tree) -> PlainTree:
    """Return the values without their reasons."""
    found: PlainTree = {}
    for key, entry in tree.items():
        value = entry.value if isinstance(entry, Explained) else entry
        found[key] = plain_values(value) if isinstance(value, Mapping) else value
    return found


def with_template(name: str, derived: Tree) -> Tree:
    """Return a template's parameters with the derived values; DesignError for a value that is missing."""
    return _filled(load_strict((TEMPLATES / name).read_text()), derived)


def _filled(template: Mapping[str, Any], derived: Tree) -> Tree:
    found: dict[str, Explained | Plain | Tree] = {}
    for key, value in template.items():
        inside = derived.get(key)
        if isinstance(value, Mapping):
            found[key] = _filled(value, inside if isinstance(inside, Mapping) else {})
        elif inside is None and value is None:
            raise DesignError(f"the template's parameter {key} has no derived value")
        else:
            found[key] = value if inside is None else inside
    return found | {key: value for key, value in derived.items() if key not in template}


def yaml_text(tree: Tree, head: str) -> str:
    """Return a YAML file with `head` as its comment; a reason follows its value, or precedes it if it is long."""
    lines = [f"# {line}" for line in head.strip().splitlines()]
    return "\n".join([*lines, *_lines(tree, 0)]) + "\n"


def _lines(tree: Tree, depth: int) -> Iterator[str]:
    margin = "  " * depth
    for key, entry in tree.items():
        if isinstance(entry, Mapping):
            yield f"{margin}{key}:"
            yield from _lines(entry, depth + 1)
            continue
        value, reason = entry if isinstance(entry, Explained) else (entry, "")
        line = f"{margin}{key}: {yaml_scalar(value)}"
        if reason and len(line) + len(reason) + 4 <= WIDTH:
            yield f"{line}  # {reason}"
            continue
        for part in textwrap.wrap(reason, WIDTH - len(margin) - 2):
            yield f"{margin}# {part}"
        yield line


def yaml_scalar(value: Plain) -> str:
    """Return a value as YAML that ROS 2 parses to the same type: 1.0 is a double, 1 an integer, "1" a string."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"[{', '.join(yaml_scalar(one) for one in value)}]"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, int):
        return str(value)
    return _double(value)


def _double(value: float) -> str:
    """With a decimal point, because YAML 1.1 parses 1e-9 as a string."""
    if not math.isfinite(value):
        raise DesignError(f"{value} is not a finite parameter")
    mantissa, mark, exponent = f"{value:.9g}".partition("e")
    return (mantissa if "." in mantissa else f"{mantissa}.0") + mark + exponent


def short(value: float) -> str:
    """Return a number with three digits for a sentence."""
    return f"{value:.3g}"


def rounded_down(value: float) -> float:
    """Return the value rounded down to a tenth of a millimetre (per second), so that a limit does not grow."""
    return math.floor(value * 1e4) / 1e4 if value > 1e-3 else value


def rounded(value: float) -> float:
    """Return the value with four digits, the accuracy of a robot file."""
    return float(f"{value:.4g}")
