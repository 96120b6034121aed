"""Params that a node can take while it runs; all others are read when it starts."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import Any

import msgspec

from chefbot.errors import UserError


def is_live(name: str, patterns: Iterable[str]) -> bool:
    """Whether a param, nested ones dotted, is among a node's `live_params`; `*` stands for any part of a name."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def changed_params(old: msgspec.Struct, new: msgspec.Struct, prefix: str = "") -> list[str]:
    """Dotted names of what differs between two params of one type."""
    found: list[str] = []
    for field in old.__struct_fields__:
        before, after = getattr(old, field), getattr(new, field)
        if isinstance(before, msgspec.Struct) and isinstance(after, msgspec.Struct):
            found += changed_params(before, after, f"{prefix}{field}.")
        elif before != after:
            found.append(prefix + field)
    return found


def check_live(node: Any, params: msgspec.Struct) -> None:
    """UserError that names what `node` would have to be started again for."""
    for name in changed_params(node.params, params):
        if not is_live(name, node.live_params):
            raise UserError(f"{node.name} reads {name} when it starts; set it in the launch file")
