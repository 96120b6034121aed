"""Message definitions as text (`ros2msg`, for MCAP) and as RIHS01 type hashes (REP-2016)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple

from chefbot.msgs.idl.fields import MessageField, fields_of, ros_type
from chefbot.msgs.idl.message import Message

_TYPE_IDS = {
    "": 1, "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9,
    "float32": 10, "float64": 11, "bool": 15, "byte": 16, "string": 17,
}  # fmt: skip
"""Type IDs of type_description_interfaces/msg/FieldType."""
_BOUNDED_STRING = 21
_FIXED_ARRAY = 48
_BOUNDED_SEQUENCE = 96
_UNBOUNDED_SEQUENCE = 144


_NO_FIELDS = "structure_needs_at_least_one_member"
"""The field that rosidl adds to a type without fields."""


class FieldDescription(NamedTuple):
    """The description of one field, as in type_description_interfaces."""

    name: str
    type_id: int
    capacity: int
    string_capacity: int
    nested: str
    """Full name of the nested type, else ''."""


class Description(NamedTuple):
    """The description of a message, service or action, as in type_description_interfaces."""

    name: str
    fields: tuple[FieldDescription, ...]
    uses: tuple[Description, ...]
    """All types that it refers to, directly or not, each once, sorted by name; their own `uses` are empty."""


@cache
def definition_text(kind: type[Message]) -> str:
    """Return the type's .msg text followed by those of all types it uses, in MCAP's `ros2msg` encoding."""
    parts = [_lines(kind)]
    for used in _referenced_types(kind):
        name = ros_type(used).replace("/msg/", "/")
        parts.append("=" * 80 + f"\nMSG: {name}\n" + _lines(used))
    return "".join(parts)


def interface_text(kind: type[Message]) -> str:
    """Return the .msg text of the type alone, a line per field; empty if it has none."""
    return "".join(
        f"{_type_text(field)} {field.name}\n" for field in fields_of(kind) if field.name != _NO_FIELDS
    )


@cache
def type_hash(kind: type[Message]) -> str:
    """Return the type hash 'RIHS01_...' of a message type."""
    return description_hash(describe(kind))


@cache
def describe(kind: type[Message]) -> Description:
    """Return the type description of a message type."""
    uses = tuple(_own_description(used) for used in sorted(_referenced_types(kind), key=ros_type))
    return _own_description(kind)._replace(uses=uses)


def compose(name: str, members: Iterable[tuple[str, Description]]) -> Description:
    """Return the type description of a service or an action from those of its members."""
    parts = tuple(members)
    fields = tuple(FieldDescription(field, _TYPE_IDS[""], 0, 0, part.name) for field, part in parts)
    uses = {used.name: used._replace(uses=()) for _, part in parts for used in (part, *part.uses)}
    return Description(name, fields, tuple(uses[key] for key in sorted(uses)))


def description_hash(description: Description) -> str:
    """Return 'RIHS01_...': the SHA-256 of the type description in canonical JSON (REP-2016)."""
    content = {
        "type_description": _to_json(description),
        "referenced_type_descriptions": [_to_json(used) for used in description.uses],
    }
    text = json.dumps(content, separators=(", ", ": "), ensure_ascii=True)
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()


@cache
def _referenced_types(kind: type[Message]) -> tuple[type[Message], ...]:
    """Return all message types that `kind` refers to, directly or not, each once, in order of first use."""
    referenced: dict[type[Message], None] = {}
    for field in fields_of(kind):
        if field.message is not None:
            referenced.setdefault(field.message)
            for nested in _referenced_types(field.message):
                referenced.setdefault(nested)
    return tuple(referenced)


def _lines(kind: type[Message]) -> str:
    return "".join(f"{_type_text(field)} {field.name}\n" for field in fields_of(kind))


def _type_text(field: MessageField) -> str:
    name = field.element or ros_type(field.message).replace("/msg/", "/")
    name += f"<={field.string_bound}" if field.string_bound else ""
    size = field.fixed_size or (f"<={field.bound}" if field.bound else "")
    return f"{name}[{size}]" if field.is_array else name


def _own_description(kind: type[Message]) -> Description:
    return Description(ros_type(kind), tuple(_describe_field(field) for field in fields_of(kind)), ())


def _describe_field(field: MessageField) -> FieldDescription:
    base = _BOUNDED_STRING if field.string_bound else _TYPE_IDS[field.element]
    nested = ros_type(field.message) if field.message else ""
    capacity = field.fixed_size or field.bound
    return FieldDescription(field.name, base + _array_offset(field), capacity, field.string_bound, nested)


def _array_offset(field: MessageField) -> int:
    if not field.is_array:
        return 0
    if field.fixed_size:
        return _FIXED_ARRAY
    return _BOUNDED_SEQUENCE if field.bound else _UNBOUNDED_SEQUENCE


def _to_json(description: Description) -> dict[str, Any]:
    return {"type_name": description.name, "fields": [_field_to_json(field) for field in description.fields]}


def _field_to_json(field: FieldDescription) -> dict[str, Any]:
    kind = {
        "type_id": field.type_id,
        "capacity": field.capacity,
        "string_capacity": field.string_capacity,
        "nested_type_name": field.nested,
    }
    return {"name": field.name, "type": kind}
