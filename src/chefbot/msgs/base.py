"""What every message is: a frozen struct whose annotations are its ROS 2 definition."""

from __future__ import annotations

import typing
from array import array
from functools import cache
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

Bool = Annotated[bool, "bool"]
Byte = Annotated[int, "byte"]
Int8 = Annotated[int, "int8"]
Uint8 = Annotated[int, "uint8"]
Int16 = Annotated[int, "int16"]
Uint16 = Annotated[int, "uint16"]
Int32 = Annotated[int, "int32"]
Uint32 = Annotated[int, "uint32"]
Int64 = Annotated[int, "int64"]
Uint64 = Annotated[int, "uint64"]
Float32 = Annotated[float, "float32"]
Float64 = Annotated[float, "float64"]
String = Annotated[str, "string"]
Int8Array = Annotated[NDArray[np.int8], "int8[]"]
Uint8Array = Annotated[NDArray[np.uint8], "uint8[]"]
Float32Array = Annotated[NDArray[np.float32], "float32[]"]
Float64Array = Annotated[NDArray[np.float64], "float64[]"]
StringArray = Annotated[tuple[str, ...], "string[]"]

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
"""Primitive ROS type to the numpy type of its little-endian form."""


class Message(msgspec.Struct, frozen=True, kw_only=False, eq=False):
    """A ROS 2 message. Its package is the module's name, its fields are the struct's, in order.

    Arrays of numbers are numpy arrays of the annotated type; arrays of messages and strings are tuples.
    """

    ROS_PACKAGE: ClassVar[str] = ""

    def __post_init__(self) -> None:
        """Give every number its field's precision now, so that nobody sees more than the wire carries."""
        floats, arrays = _roundings(type(self))
        if floats:
            rounded = array("f", [getattr(self, name) for name in floats]).tolist()
            for name, value in zip(floats, rounded, strict=True):
                msgspec.structs.force_setattr(self, name, value)
        for name, kind in arrays:
            msgspec.structs.force_setattr(self, name, np.asarray(getattr(self, name), kind))

    def to_cdr(self) -> bytes:
        """Little-endian XCDR1 with its four header bytes, as Fast-CDR writes it."""
        from chefbot.msgs.cdr import encode

        return encode(self)

    @classmethod
    def from_cdr(cls, data: bytes) -> Self:
        """The message in the bytes; arrays are read-only views of them. CdrError when they do not fit."""
        from chefbot.msgs.cdr import decode

        return decode(cls, data)


class FieldType(NamedTuple):
    """One field of a definition."""

    name: str
    element: str
    """Primitive name, 'string', or '' for a message."""
    message: type[Message] | None
    is_array: bool
    fixed_size: int
    """0 unless the array has a fixed length."""
    bound: int = 0
    """Most elements that a sequence may have, 0 for any number."""
    string_bound: int = 0
    """Most bytes that a string may have, 0 for any number."""


@cache
def _roundings(kind: type[Message]) -> tuple[tuple[str, ...], tuple[tuple[str, np.dtype[Any]], ...]]:
    """Fields whose values can hold more than their type: single floats, and arrays with theirs."""
    fields = [field for field in fields_of(kind) if field.element in NUMPY_TYPES]
    floats = tuple(field.name for field in fields if field.element == "float32" and not field.is_array)
    arrays = ((field.name, np.dtype(NUMPY_TYPES[field.element])) for field in fields if field.is_array)
    return floats, tuple(arrays)


@cache
def ros_type(kind: type[Message]) -> str:
    """'sensor_msgs/msg/LaserScan' and the like, from module and class name."""
    package = kind.ROS_PACKAGE or kind.__module__.rpartition(".")[2]
    first = kind.__name__.partition("_")[2]
    if not first:
        folder = "msg"
    elif first in ("Request", "Response", "Event"):
        folder = "srv"
    else:
        folder = "action"
    return f"{package}/{folder}/{kind.__name__}"


@cache
def fields_of(kind: type[Message]) -> tuple[FieldType, ...]:
    """The definition of a message type, in order."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return tuple(_field(name, hints[name]) for name in kind.__struct_fields__)


def _field(name: str, hint: Any) -> FieldType:
    if isinstance(hint, type) and issubclass(hint, Message):
        return FieldType(name, "", hint, False, 0)
    text = "" if typing.get_origin(hint) is tuple else hint.__metadata__[0]
    inner = hint.__origin__ if typing.get_origin(hint) is Annotated else hint
    if typing.get_origin(inner) is tuple and typing.get_args(inner)[0] is not str:
        return FieldType(name, "", typing.get_args(inner)[0], True, 0, int(text.removeprefix("<=") or 0))
    element, bracket, size = text.partition("[")
    element, _, string_bound = element.partition("<=")
    size = size.removesuffix("]")
    fixed, bound = (0, int(size[2:])) if size.startswith("<=") else (int(size or 0), 0)
    return FieldType(name, element, None, bool(bracket), fixed, bound, int(string_bound or 0))
