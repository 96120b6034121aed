"""Conversion between messages and plain data (dicts, lists, numbers, strings), as in YAML and JSON."""

from __future__ import annotations

from typing import Any, TypeVar, cast

import numpy as np

from chefbot.errors import name_hint
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.fields import NUMPY_TYPES, MessageField, fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Header

M = TypeVar("M", bound=Message)
NOW, AUTO = "now", "auto"
"""Placeholders for the current time in a time field and in a header, as in ROS 2's command-line tools."""


def message_to_dict(message: Message, max_elements: int | None = None) -> dict[str, Any]:
    """Convert a message to a dict of its fields.

    Arrays are cut to `longest` elements, followed by a string with the number of elements left out.
    """
    return {
        field.name: _plain(field, getattr(message, field.name), max_elements)
        for field in fields_of(type(message))
    }


def message_from_dict(kind: type[M], plain: Any, where: str, now: Time | None = None) -> M:
    """Convert plain data to a message; missing fields get their defaults.

    `now`: the time for the placeholders. InvalidMessageError, beginning with `where`, for unknown fields, wrong types
    and numbers out of range.
    """
    return cast(M, _message(kind, plain, where, now))


def _plain(field: MessageField, value: Any, longest: int | None) -> Any:
    if not field.is_array:
        return _plain_element(field, value, longest)
    shown = value if longest is None else value[:longest]
    plain = [_plain_element(field, element, longest) for element in shown]
    if len(value) > len(plain):
        plain.append(f"... {len(value) - len(plain)} more")
    return plain


def _plain_element(field: MessageField, value: Any, longest: int | None) -> Any:
    if field.message is not None:
        return message_to_dict(value, longest)
    if field.element == "string":
        return value
    if field.element == "float32":
        return float(str(np.float32(value)))  # shortest decimal: 0.1, not 0.10000000149011612
    return np.dtype(NUMPY_TYPES[field.element]).type(value).item()


def _message(kind: type[Message], plain: Any, where: str, now: Time | None) -> Message:
    if now is not None and ((kind is Time and plain == NOW) or (kind is Header and plain == AUTO)):
        return now if kind is Time else Header(now)
    if plain is None:
        plain = {}
    fields = {field.name: field for field in fields_of(kind)}
    if not isinstance(plain, dict):
        raise InvalidMessageError(
            f"{where}: {ros_type(kind)} has the fields {', '.join(fields) or 'none'}; write {{name: value}}"
        )
    for name in plain:
        if name not in fields:
            raise InvalidMessageError(
                f"{where}: {ros_type(kind)} has no field {name!r}{name_hint(str(name), fields)}"
            )
    values = {name: _value(fields[name], item, f"{where}: {name}", now) for name, item in plain.items()}
    return kind(**values)


def _value(field: MessageField, plain: Any, where: str, now: Time | None) -> Any:
    if not field.is_array:
        return _element(field, plain, where, now)
    if not isinstance(plain, (list, tuple)):
        raise InvalidMessageError(f"{where} is a list: write [a, b]")
    if field.fixed_size and len(plain) != field.fixed_size:
        raise InvalidMessageError(f"{where} has {field.fixed_size} elements, not {len(plain)}")
    if field.bound and len(plain) > field.bound:
        raise InvalidMessageError(f"{where} has at most {field.bound} elements, not {len(plain)}")
    values = [_element(field, item, f"{where}[{index}]", now) for index, item in enumerate(plain)]
    if field.message is not None or field.element == "string":
        return tuple(values)
    return np.array(values, np.dtype(NUMPY_TYPES[field.element]))


def _element(field: MessageField, plain: Any, where: str, now: Time | None) -> Any:
    if field.message is not None:
        return _message(field.message, plain, where, now)
    if field.element == "string":
        return _text(plain, field.string_bound, where)
    if field.element == "bool":
        if not isinstance(plain, bool):
            raise InvalidMessageError(f"{where} is true or false, not {plain!r}")
        return plain
    if field.element in ("float32", "float64"):
        return _float(plain, where)
    return _integer(plain, np.iinfo(NUMPY_TYPES[field.element]), where)


def _text(plain: Any, bound: int, where: str) -> str:
    if not isinstance(plain, str):
        raise InvalidMessageError(f"{where} is a text, not {plain!r}; put it in quotes")
    if bound and len(plain.encode()) > bound:
        raise InvalidMessageError(f"{where} has at most {bound} bytes")
    return plain


def _float(plain: Any, where: str) -> float:
    """Convert to a float; strings are accepted, as YAML parses 1e-3 as a string."""
    try:
        if isinstance(plain, (int, float, str)) and not isinstance(plain, bool):
            return float(plain)
    except (ValueError, OverflowError):
        pass
    raise InvalidMessageError(f"{where} is a number, not {plain!r}")


def _integer(plain: Any, limits: np.iinfo[Any], where: str) -> int:
    if isinstance(plain, bool) or not isinstance(plain, int):
        raise InvalidMessageError(f"{where} is a whole number, not {plain!r}")
    if not limits.min <= plain <= limits.max:
        raise InvalidMessageError(f"{where} must lie between {limits.min} and {limits.max}, not {plain}")
    return plain
