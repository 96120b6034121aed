"""Values of a param struct by dotted names, as ROS 2's tools list and set them."""

from __future__ import annotations

from typing import Any, NamedTuple

import msgspec
from msgspec import inspect as types

from chefbot.errors import UserError, name_hint


class ParameterInfo(NamedTuple):
    """A parameter's value and its type with constraints."""

    value: Any
    kind: types.Type


def flatten(params: msgspec.Struct, prefix: str = "") -> dict[str, ParameterInfo]:
    """Flatten nested params to dotted names; the bridge sends values that ROS has no type for as JSON."""
    info = types.type_info(type(params))
    assert isinstance(info, types.StructType)
    flat: dict[str, ParameterInfo] = {}
    for field in info.fields:
        value = getattr(params, field.name)
        if isinstance(value, msgspec.Struct):
            flat |= flatten(value, f"{prefix}{field.name}.")
        else:
            flat[prefix + field.name] = ParameterInfo(value, field.type)
    return flat


def is_secret(parameter: ParameterInfo) -> bool:
    """Return whether a parameter is not shown to others on the network, by `Meta(extra={"secret": True})`."""
    kind = parameter.kind
    return isinstance(kind, types.Metadata) and bool((kind.extra or {}).get("secret"))


def with_values(params: msgspec.Struct, values: dict[str, Any]) -> dict[str, Any]:
    """Return the params as plain data with `values`, by dotted name, changed.

    Raises UserError for an unknown name.
    """
    plain: dict[str, Any] = msgspec.to_builtins(params)
    for name, value in values.items():
        *path, last = name.split(".")
        parent = plain
        for key in path:
            parent = parent[key]
        if last not in parent:
            raise UserError(f"there is no parameter {name!r}{name_hint(name, flatten(params))}")
        parent[last] = float(value) if isinstance(parent[last], float) and type(value) is int else value
    return plain
