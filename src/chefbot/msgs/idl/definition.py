"""Definitions as text (`ros2msg`, for MCAP) and as RIHS01 hashes (REP-2016), both from the annotations."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple

from chefbot.msgs.idl.fields import FieldType, fields_of, ros_type
from chefbot.msgs.idl.message import Message

_TYPE_IDS = {
    "": 1, "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9,
    "float32": 10, "float64": 11, "bool": 15, "byte": 16, "string": 17,
}  # fmt: skip
"""type_description_interfaces/msg/FieldType."""
_BOUNDED_STRING = 21
_FIXED_ARRAY = 48
_BOUNDED_SEQUENCE = 96
_UNBOUNDED_SEQUENCE = 144


_NO_FIELDS = "structure_needs_at_least_one_member"
"""What rosidl gives a type without fields."""


class FieldDescription(NamedTuple):
    """One field as type_description_interfaces tells it."""

    name: str
    type_id: int
    capacity: int
    string_capacity: int
    nested: str
    """Full name of a nested type, else ''."""


class Description(NamedTuple):
    """A message, service or action as type_description_interfaces tells it."""

    name: str
    fields: tuple[FieldDescription, ...]
    uses: tuple[Description, ...]
    """All types below it, each once, sorted by name; their own `uses` are empty."""


@cache
def definition_text(kind: type[Message]) -> str:
    """The type's .msg text followed by those of all that it uses, as MCAP's `ros2msg` wants it."""
    parts = [_lines(kind)]
    for used in _used_by(kind):
        name = ros_type(used).replace("/msg/", "/")
        parts.append("=" * 80 + f"\nMSG: {name}\n" + _lines(used))
    return "".join(parts)


def own_text(kind: type[Message]) -> str:
    """The type's .msg text alone: its fields, a line each; nothing for one that has none."""
    return "".join(f"{_type_text(one)} {one.name}\n" for one in fields_of(kind) if one.name != _NO_FIELDS)


@cache
def type_hash(kind: type[Message]) -> str:
    """'RIHS01_...' of a message."""
    return description_hash(describe(kind))


@cache
def describe(kind: type[Message]) -> Description:
    """The description of a message."""
    uses = tuple(_own_description(one) for one in sorted(_used_by(kind), key=ros_type))
    return _own_description(kind)._replace(uses=uses)


def compose(name: str, members: Iterable[tuple[str, Description]]) -> Description:
    """The description of what is no message itself but made of some: a service, an action."""
    parts = tuple(members)
    fields = tuple(FieldDescription(field, _TYPE_IDS[""], 0, 0, part.name) for field, part in parts)
    below = {one.name: one._replace(uses=()) for _, part in parts for one in (part, *part.uses)}
    return Description(name, fields, tuple(below[key] for key in sorted(below)))


def description_hash(description: Description) -> str:
    """'RIHS01_...': sha256 of the type description in its canonical JSON (REP-2016)."""
    plain = {
        "type_description": _plain(description),
        "referenced_type_descriptions": [_plain(one) for one in description.uses],
    }
    text = json.dumps(plain, separators=(", ", ": "), ensure_ascii=True)
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()


@cache
def _used_by(kind: type[Message]) -> tuple[type[Message], ...]:
    """All message types below `kind`, each once, in order of first use."""
    found: dict[type[Message], None] = {}
    for field in fields_of(kind):
        if field.message is not None:
            found.setdefault(field.message)
            for deeper in _used_by(field.message):
                found.setdefault(deeper)
    return tuple(found)


def _lines(kind: type[Message]) -> str:
    return "".join(f"{_type_text(field)} {field.name}\n" for field in fields_of(kind))


def _type_text(field: FieldType) -> str:
    name = field.element or ros_type(field.message).replace("/msg/", "/")
    name += f"<={field.string_bound}" if field.string_bound else ""
    size = field.fixed_size or (f"<={field.bound}" if field.bound else "")
    return f"{name}[{size}]" if field.is_array else name


def _own_description(kind: type[Message]) -> Description:
    return Description(ros_type(kind), tuple(_describe_field(field) for field in fields_of(kind)), ())


def _describe_field(field: FieldType) -> FieldDescription:
    base = _BOUNDED_STRING if field.string_bound else _TYPE_IDS[field.element]
    nested = ros_type(field.message) if field.message else ""
    capacity = field.fixed_size or field.bound
    return FieldDescription(field.name, base + _array_offset(field), capacity, field.string_bound, nested)


def _array_offset(field: FieldType) -> int:
    if not field.is_array:
        return 0
    if field.fixed_size:
        return _FIXED_ARRAY
    return _BOUNDED_SEQUENCE if field.bound else _UNBOUNDED_SEQUENCE


def _plain(description: Description) -> dict[str, Any]:
    return {"type_name": description.name, "fields": [_plain_field(one) for one in description.fields]}


def _plain_field(field: FieldDescription) -> dict[str, Any]:
    kind = {
        "type_id": field.type_id,
        "capacity": field.capacity,
        "string_capacity": field.string_capacity,
        "nested_type_name": field.nested,
    }
    return {"name": field.name, "type": kind}
