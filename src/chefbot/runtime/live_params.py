"""Parameters that can change at run time; all others are read when a node starts."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import Any

import msgspec

from chefbot.errors import UserError


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
