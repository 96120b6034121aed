"""Parameter values with the reason for each, and YAML files made of them."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Mapping
from typing import NamedTuple, TypeAlias

Plain: TypeAlias = bool | int | float | str | list[str] | list[float] | list[bool]
"""What a ROS 2 parameter can be; an empty list has no type and is none."""
WIDTH = 110


class Because(NamedTuple):
    """A parameter's value and the reason for it: formula and numbers."""

    value: Plain
    why: str = ""


Tree: TypeAlias = Mapping[str, "Because | Plain | Tree"]
PlainTree: TypeAlias = dict[str, "Plain | PlainTree"]


def plain(tree: Tree) -> PlainTree:
    """Return the values without their reasons."""
    found: PlainTree = {}
    for key, entry in tree.items():
        value = entry.value if isinstance(entry, Because) else entry
        found[key] = plain(value) if isinstance(value, Mapping) else value
    return found


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
        value, why = entry if isinstance(entry, Because) else (entry, "")
        line = f"{margin}{key}: {written(value)}"
        if why and len(line) + len(why) + 4 <= WIDTH:
            yield f"{line}  # {why}"
            continue
        for part in textwrap.wrap(why, WIDTH - len(margin) - 2):
            yield f"{margin}# {part}"
        yield line


def written(value: Plain) -> str:
    """Return a value as YAML that ROS 2 parses to the same type: 1.0 is a double, 1 an integer, "1" a string."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"[{', '.join(written(one) for one in value)}]"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, int):
        return str(value)
    return _double(value)


def _double(value: float) -> str:
    """Always with a point: YAML 1.1 takes 1e-9 for a string."""
    if not math.isfinite(value):
        raise ValueError(f"{value} is no parameter")
    mantissa, mark, exponent = f"{value:.9g}".partition("e")
    return (mantissa if "." in mantissa else f"{mantissa}.0") + mark + exponent


def short(value: float) -> str:
    """Return a number with three digits for a sentence."""
    return f"{value:.3g}"


def at_most(value: float) -> float:
    """Return the value rounded down to a tenth of a millimetre (per second), so that a limit does not grow."""
    return math.floor(value * 1e4) / 1e4 if value > 1e-3 else value


def rounded(value: float) -> float:
    """Return the value with four digits, the accuracy of a robot file."""
    return float(f"{value:.4g}")
