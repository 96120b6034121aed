"""Messages as dicts, lists, numbers and texts, as YAML and JSON show them and people write them, and back."""

from __future__ import annotations

from typing import Any, TypeVar, cast

import numpy as np

from chefbot.errors import UserError, nearest
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.fields import NUMPY_TYPES, FieldType, fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Header

M = TypeVar("M", bound=Message)
NOW, AUTO = "now", "auto"
"""What may be written for a time, and for a header, as with ROS 2's own tools."""


def to_plain(message: Message, longest: int | None = None) -> dict[str, Any]:
    """Field names to values. Of arrays at most `longest` elements, behind which a text tells how many more."""
    return {
        field.name: _plain(field, getattr(message, field.name), longest) for field in fields_of(type(message))
    }


def from_plain(kind: type[M], plain: Any, where: str, now: Time | None = None) -> M:
    """The message; fields left out have their defaults, `now` stands for the time of that name.

    UserError, beginning with `where`, for unknown fields, other types, numbers that do not fit.
    """
    return cast(M, _message(kind, plain, where, now))


def _plain(field: FieldType, value: Any, longest: int | None) -> Any:
    if not field.is_array:
        return _plain_one(field, value, longest)
    shown = value if longest is None else value[:longest]
    plain = [_plain_one(field, one, longest) for one in shown]
    if len(value) > len(plain):
        plain.append(f"... {len(value) - len(plain)} more")
    return plain


def _plain_one(field: FieldType, value: Any, longest: int | None) -> Any:
    if field.message is not None:
        return to_plain(value, longest)
    if field.element == "string":
        return value
    if field.element == "float32":
        return float(
            str(np.float32(value))
        )  # 0.1, not 0.10000000149011612: the same number in single precision
    return np.dtype(NUMPY_TYPES[field.element]).type(value).item()


def _message(kind: type[Message], plain: Any, where: str, now: Time | None) -> Message:
    if now is not None and ((kind is Time and plain == NOW) or (kind is Header and plain == AUTO)):
        return now if kind is Time else Header(now)
    if plain is None:
        plain = {}
    fields = {field.name: field for field in fields_of(kind)}
    if not isinstance(plain, dict):
        raise UserError(
            f"{where}: {ros_type(kind)} has the fields {', '.join(fields) or 'none'}; write {{name: value}}"
        )
    for name in plain:
        if name not in fields:
            raise UserError(f"{where}: {ros_type(kind)} has no field {name!r}{nearest(str(name), fields)}")
    values = {name: _value(fields[name], one, f"{where}: {name}", now) for name, one in plain.items()}
    return kind(**values)


def _value(field: FieldType, plain: Any, where: str, now: Time | None) -> Any:
    if not field.is_array:
        return _one(field, plain, where, now)
    if not isinstance(plain, (list, tuple)):
        raise UserError(f"{where} is a list: write [a, b]")
    if field.fixed_size and len(plain) != field.fixed_size:
        raise UserError(f"{where} has {field.fixed_size} elements, not {len(plain)}")
    if field.bound and len(plain) > field.bound:
        raise UserError(f"{where} has at most {field.bound} elements, not {len(plain)}")
    values = [_one(field, one, f"{where}[{index}]", now) for index, one in enumerate(plain)]
    if field.message is not None or field.element == "string":
        return tuple(values)
    return np.array(values, np.dtype(NUMPY_TYPES[field.element]))


def _one(field: FieldType, plain: Any, where: str, now: Time | None) -> Any:
    if field.message is not None:
        return _message(field.message, plain, where, now)
    if field.element == "string":
        return _text(plain, field.string_bound, where)
    if field.element == "bool":
        if not isinstance(plain, bool):
            raise UserError(f"{where} is true or false, not {plain!r}")
        return plain
    if field.element in ("float32", "float64"):
        return _float(plain, where)
    return _whole(plain, np.iinfo(NUMPY_TYPES[field.element]), where)


def _text(plain: Any, bound: int, where: str) -> str:
    if not isinstance(plain, str):
        raise UserError(f"{where} is a text, not {plain!r}; put it in quotes")
    if bound and len(plain.encode()) > bound:
        raise UserError(f"{where} has at most {bound} bytes")
    return plain


def _float(plain: Any, where: str) -> float:
    """YAML takes 1e-3 for a text; people do not."""
    try:
        if isinstance(plain, (int, float, str)) and not isinstance(plain, bool):
            return float(plain)
    except (ValueError, OverflowError):
        pass
    raise UserError(f"{where} is a number, not {plain!r}")


def _whole(plain: Any, limits: np.iinfo[Any], where: str) -> int:
    if isinstance(plain, bool) or not isinstance(plain, int):
        raise UserError(f"{where} is a whole number, not {plain!r}")
    if not limits.min <= plain <= limits.max:
        raise UserError(f"{where} must lie between {limits.min} and {limits.max}, not {plain}")
    return plain
