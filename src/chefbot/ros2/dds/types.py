"""Message types as Cyclone DDS wants them, generated from our own definitions; samples stay bytes.

Cyclone checks every sample that is written against a description of its type, in C. Its Python serializer, which
takes a tenth of a second for a picture, is never called: a sample here is its CDR bytes.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from cyclonedds.idl import make_idl_struct, types

from chefbot.msgs.idl.fields import FieldType, fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.ros2.rmw.names import WireType

_PRIMITIVES = {
    "bool": bool, "byte": types.uint8, "string": str, "int8": types.int8, "uint8": types.uint8,
    "int16": types.int16, "uint16": types.uint16, "int32": types.int32, "uint32": types.uint32,
    "int64": types.int64, "uint64": types.uint64, "float32": types.float32, "float64": types.float64,
}  # fmt: skip
"""A byte is uint8, as rmw_cyclonedds (dyntype.cpp) and rmw_fastrtps (TypeSupport_impl.cpp) tell it: DDS compares."""


@cache
def sample_type(kind: type[Message]) -> type[Any]:
    """The DDS type of a message; an instance has its CDR bytes as `cdr` and nothing else."""
    made = idl_struct(kind)
    made.serialize = _written
    made.deserialize = classmethod(sample)
    made.deserialize_key = classmethod(sample)
    return made


def sample(kind: Any, cdr: bytes) -> Any:
    """A sample of a type that `sample_type` made."""
    made = kind.__new__(kind)
    made.cdr = cdr
    return made


def _written(one: Any, **_: Any) -> bytes:
    """In place of Cyclone's serializer, which is asked for one version or the other."""
    return bytes(one.cdr)


@cache
def idl_struct(kind: type[Message]) -> type[Any]:
    """A plain IDL struct of the same name and fields (OMG DDS-XTypes; ROS names it `pkg::msg::dds_::Name_`)."""
    name = WireType(ros_type(kind), "").dds
    fields = {field.name: _idl_field(field) for field in fields_of(kind)}
    return make_idl_struct(name.rpartition("::")[2], name, fields)


def _idl_field(field: FieldType) -> Any:
    element: Any
    if field.message is not None:
        element = idl_struct(field.message)
    elif field.string_bound:
        element = types.bounded_str[field.string_bound]
    else:
        element = _PRIMITIVES[field.element]
    if field.fixed_size:
        return types.array[element, field.fixed_size]
    if not field.is_array:
        return element
    return types.sequence[element, field.bound] if field.bound else types.sequence[element]
