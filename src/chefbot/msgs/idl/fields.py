"""The field definitions of message types, read from their annotations."""

from __future__ import annotations

import typing
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple, cast

import msgspec

if TYPE_CHECKING:
    from chefbot.msgs.idl.message import Message

NUMPY_TYPES = {
    "bool": "?",
    "byte": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "<i2",
    "uint16": "<u2",
    "int32": "<i4",
    "uint32": "<u4",
    "int64": "<i8",
    "uint64": "<u8",
    "float32": "<f4",
    "float64": "<f8",
}
"""Numpy types of the primitive ROS types in little-endian form."""


class MessageField(NamedTuple):
    """The type of one field of a message."""

    name: str
    element: str
    """Name of the primitive type, 'string', or '' for a nested message."""
    message: type[Message] | None
    is_array: bool
    fixed_size: int
    """Length of an array of fixed size, else 0."""
    bound: int = 0
    """Maximum number of elements of a sequence, 0 if unbounded."""
    string_bound: int = 0
    """Maximum number of bytes of a string, 0 if unbounded."""


@cache
def ros_type(kind: type[Message]) -> str:
    """Return the ROS name of a type, such as 'sensor_msgs/msg/LaserScan', from its module and class name."""
    package = kind.ros_package()
    first = kind.__name__.partition("_")[2]
    if not first:
        folder = "msg"
    elif first in ("Request", "Response", "Event"):
        folder = "srv"
    else:
        folder = "action"
    return f"{package}/{folder}/{kind.__name__}"


@cache
def fields_of(kind: type[Message]) -> tuple[MessageField, ...]:
    """Return the fields of a message type in order."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return tuple(
        _field(name, hint) for name, hint in hints.items() if typing.get_origin(hint) is not ClassVar
    )


def _field(name: str, hint: Any) -> MessageField:
    if isinstance(hint, type) and issubclass(hint, msgspec.Struct):
        return MessageField(name, "", cast("type[Message]", hint), False, 0)
    text = "" if typing.get_origin(hint) is tuple else hint.__metadata__[0]
    inner = hint.__origin__ if typing.get_origin(hint) is Annotated else hint
    if typing.get_origin(inner) is tuple and typing.get_args(inner)[0] is not str:
        fixed, bound = _array_size(text)
        return MessageField(name, "", typing.get_args(inner)[0], True, fixed, bound)
    element, bracket, size = text.partition("[")
    element, _, string_bound = element.partition("<=")
    fixed, bound = _array_size(size.removesuffix("]"))
    return MessageField(name, element, None, bool(bracket), fixed, bound, int(string_bound or 0))


def _array_size(text: str) -> tuple[int, int]:
    """Return the fixed size and the bound of an array, 0 for none: `4` and `<=4` in ROS's definitions."""
    return (0, int(text[2:])) if text.startswith("<=") else (int(text or 0), 0)
