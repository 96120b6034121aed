"""Typed values as the text of a YAML file, in the notation that `chefbot.config` reads."""

from __future__ import annotations

from typing import Annotated, Any, get_args, get_origin, get_type_hints

import msgspec
import yaml

DECIMALS = 12
"""Decimals of a number in a file: more than any quantity has, fewer than a rounding error has."""


def yaml_text(data: dict[str, Any], comment: str) -> str:
    """Return the YAML text of a file's sections, one element a line.

    comment: text of its first lines.
    """
    header = "".join(f"# {line}\n" for line in comment.splitlines())
    return header + "".join(_section(key, value) for key, value in data.items())


def plain_sections(struct: msgspec.Struct) -> dict[str, Any]:
    """Return a struct as dictionaries of what is not the default, numbers with their unit."""
    sections: dict[str, Any] = _plain(struct, "")
    return sections


def _section(key: str, value: Any) -> str:
    if isinstance(value, list) and value:
        return f"{key}:\n" + "".join(f"  - {_flow(one)}\n" for one in value)
    if isinstance(value, dict) and value:
        return f"{key}:\n" + "".join(f"  {name}: {_flow(one)}\n" for name, one in value.items())
    return f"{key}: {_flow(value)}\n"


def _flow(value: Any) -> str:
    """Return a value on one line."""
    text: str = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=float("inf"))
    return text.removesuffix("...\n").strip()


def _plain(value: Any, unit: str) -> Any:
    if isinstance(value, msgspec.Struct):
        hints = get_type_hints(type(value), include_extras=True)
        fields = {
            f.name: getattr(value, f.name) for f in msgspec.structs.fields(value) if not _is_default(value, f)
        }
        config = type(value).__struct_config__
        tag = {config.tag_field: config.tag} if config.tag_field else {}
        return {**tag, **{name: _plain(one, _unit(hints[name])) for name, one in fields.items()}}
    if isinstance(value, list | tuple):
        return [_plain(one, unit) for one in value]
    if isinstance(value, dict):
        return {name: _plain(one, unit) for name, one in value.items()}
    if isinstance(value, float):
        value = round(value, DECIMALS)
    return f"{value!r} {unit}" if unit else value


def _is_default(struct: msgspec.Struct, field: Any) -> bool:
    default = field.default if field.default_factory is msgspec.NODEFAULT else field.default_factory()
    return bool(getattr(struct, field.name) == default)


def _unit(hint: Any) -> str:
    """Return the unit of a number, or of the numbers of a list, by its type; empty if it has none."""
    if get_origin(hint) is Annotated:
        base, *metas = get_args(hint)
        units = (meta.extra["unit"] for meta in metas if meta.extra and "unit" in meta.extra)
        return next(units, "") or _unit(base)
    return next((unit for argument in get_args(hint) if (unit := _unit(argument))), "")
