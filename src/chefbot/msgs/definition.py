"""Definitions as text (`ros2msg`, for MCAP) and as RIHS01 hashes (REP-2016), both from the annotations."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from typing import Any

from chefbot.msgs.base import FieldType, Message, fields_of, ros_type

_TYPE_IDS = {
    "": 1, "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9,
    "float32": 10, "float64": 11, "bool": 15, "byte": 16, "string": 17,
}  # fmt: skip
"""type_description_interfaces/msg/FieldType."""
_FIXED_ARRAY = 48
_UNBOUNDED_SEQUENCE = 144


@cache
def definition_text(kind: type[Message]) -> str:
    """The type's .msg text followed by those of all that it uses, as MCAP's `ros2msg` wants it."""
    parts = [_lines(kind)]
    for used in _used_by(kind):
        name = ros_type(used).replace("/msg/", "/")
        parts.append("=" * 80 + f"\nMSG: {name}\n" + _lines(used))
    return "".join(parts)


@cache
def type_hash(kind: type[Message]) -> str:
    """'RIHS01_...': sha256 of the type description in its canonical JSON."""
    used = sorted(_used_by(kind), key=ros_type)
    description = {
        "type_description": _describe(kind),
        "referenced_type_descriptions": [_describe(one) for one in used],
    }
    text = json.dumps(description, separators=(", ", ": "), ensure_ascii=True)
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
    return f"{name}[{field.fixed_size or ''}]" if field.is_array else name


def _describe(kind: type[Message]) -> dict[str, Any]:
    return {"type_name": ros_type(kind), "fields": [_describe_field(field) for field in fields_of(kind)]}


def _describe_field(field: FieldType) -> dict[str, Any]:
    offset = 0 if not field.is_array else _FIXED_ARRAY if field.fixed_size else _UNBOUNDED_SEQUENCE
    kind = {
        "type_id": _TYPE_IDS[field.element] + offset,
        "capacity": field.fixed_size,
        "string_capacity": 0,
        "nested_type_name": ros_type(field.message) if field.message else "",
    }
    return {"name": field.name, "type": kind}
