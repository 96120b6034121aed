"""The base class of messages: a frozen struct whose annotations are its ROS 2 definition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Self, cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.idl.cdr import decode, encode
from chefbot.msgs.idl.constraints import Bounds, Rule
from chefbot.msgs.idl.precision import rounding

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
Uint8Array16 = Annotated[NDArray[np.uint8], "uint8[16]"]
"""The bytes of a unique identifier."""
NIL = np.zeros(16, np.uint8)
"""The identifier of nothing."""


class Message(msgspec.Struct, frozen=True, kw_only=False, eq=False):
    """Base class of all ROS 2 messages.

    Its module's name is the package, and the struct's fields are the message's, in order. Arrays of numbers
    are numpy arrays of the annotated type; arrays of messages and strings are tuples.
    """

    ROS_PACKAGE: ClassVar[str] = ""
    """Package of the type, if it is not the module's name."""
    BOUNDS: ClassVar[Mapping[str, Bounds]] = {}
    """Bounds of numbers by field; those of others are `validity.MAX_ABS_VALUE`."""
    MAX_LENGTHS: ClassVar[Mapping[str, int]] = {}
    """Maximum lengths of strings and arrays by field; those of others are in `validity`."""
    RULES: ClassVar[tuple[Rule, ...]] = ()
    """Constraints between fields."""

    def __init_subclass__(cls) -> None:
        """Make a type with numbers of lower precision round them when a message is created."""
        rounds = rounding(cls)
        if rounds is not None:
            cls.__post_init__ = rounds  # type: ignore[attr-defined]

    @classmethod
    def ros_package(cls) -> str:
        """Return the package of the type."""
        return cls.ROS_PACKAGE or cls.__module__.rpartition(".")[2]

    def to_cdr(self) -> bytes:
        """Serialize to little-endian XCDR1 with the four-byte encapsulation header, as Fast-CDR does."""
        return encode(self)

    @classmethod
    def from_cdr(cls, data: bytes) -> Self:
        """Deserialize a message from XCDR1 bytes with the encapsulation header.

        Its arrays are read-only views of `data`. CdrError if the bytes are invalid.
        """
        return decode(cls, data)


def define_message(
    name: str, fields: Sequence[tuple[str, Any, Any]], module: str, package: str = ""
) -> type[Message]:
    """Define a message class at run time; `fields` holds the name, annotation and default of each field."""
    namespace = {"ROS_PACKAGE": package}
    kind = msgspec.defstruct(
        name, fields, bases=(Message,), module=module, namespace=namespace, frozen=True, eq=False
    )
    return cast(type[Message], kind)
