"""Parameters that can change at run time; all others are read when a node starts."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase
from functools import cache
from typing import Any

import msgspec
from msgspec import inspect as types

from chefbot.errors import UserError

SMALLER, LARGER = "smaller", "larger"
"""Values of the key `safer` in a parameter's `Meta(extra=...)`: the direction in which it is stricter."""


def is_live(name: str, patterns: Iterable[str]) -> bool:
    """Return whether a parameter can change at run time.

    `name` is dotted for nested parameters; in `patterns`, a node's `live_params`, `*` matches any part of a
    name.
    """
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def changed_params(old: msgspec.Struct, new: msgspec.Struct, prefix: str = "") -> list[str]:
    """Return the dotted names of the parameters that differ between two structs of one type."""
    names: list[str] = []
    for field in old.__struct_fields__:
        before, after = getattr(old, field), getattr(new, field)
        if isinstance(before, msgspec.Struct) and isinstance(after, msgspec.Struct):
            names += changed_params(before, after, f"{prefix}{field}.")
        elif before != after:
            names.append(prefix + field)
    return names


def check_live(node: Any, params: msgspec.Struct) -> None:
    """Raise UserError if a changed parameter of `node` can only change by a restart."""
    for name in changed_params(node.params, params):
        if not is_live(name, node.live_params):
            raise UserError(f"{node.name} reads {name} when it starts; set it in the launch file")


def check_safety(node: Any, launched: msgspec.Struct, params: msgspec.Struct) -> None:
    """Raise UserError if a parameter of safety of `node` is less strict than in the launch.

    A stricter value can be set, and taken back as far as the value of the launch.
    """
    for name, safer in safer_directions(type(params)).items():
        limit, value = _value(launched, name), _value(params, name)
        if value > limit if safer == SMALLER else value < limit:
            other = LARGER if safer == SMALLER else SMALLER
            raise UserError(
                f"{node.name} keeps {name} at {limit:g}, not {value:g}: a parameter of safety cannot become {other} "
                "than in the launch while the robot runs; set it in the launch file and start again"
            )


@cache
def safer_directions(kind: type[msgspec.Struct], prefix: str = "") -> dict[str, str]:
    """Return the dotted names of the parameters of safety of a struct type, each with its stricter direction."""
    info = types.type_info(kind)
    assert isinstance(info, types.StructType)
    found: dict[str, str] = {}
    for field in info.fields:
        inner = field.type
        if isinstance(inner, types.StructType):
            found |= safer_directions(inner.cls, f"{prefix}{field.name}.")
        elif isinstance(inner, types.Metadata) and (inner.extra or {}).get("safer"):
            found[prefix + field.name] = str((inner.extra or {})["safer"])
    return found


def _value(params: Any, name: str) -> float:
    for part in name.split("."):
        params = getattr(params, part)
    return float(params)
