"""Message types for Cyclone DDS, generated from our own definitions; samples stay CDR bytes.

Cyclone checks every written sample against a description of its type, in C. Its Python serializer, which
takes a tenth of a second for an image, is never called.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from cyclonedds.idl import make_idl_struct, types

from chefbot.msgs.idl.fields import MessageField, fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.ros2.rmw.names import InterfaceType

_PRIMITIVES = {
    "bool": bool, "byte": types.uint8, "string": str, "int8": types.int8, "uint8": types.uint8,
    "int16": types.int16, "uint16": types.uint16, "int32": types.int32, "uint32": types.uint32,
    "int64": types.int64, "uint64": types.uint64, "float32": types.float32, "float64": types.float64,
}  # fmt: skip
"""IDL types by ROS name. byte is uint8, as in rmw_cyclonedds (dyntype.cpp) and rmw_fastrtps
(TypeSupport_impl.cpp), because DDS compares types."""


@cache
def sample_type(kind: type[Message]) -> type[Any]:
    """Return the DDS type of a message; an instance holds only its CDR bytes, as `cdr`."""
    dds_type = idl_struct(kind)
    dds_type.serialize = _serialize
    dds_type.deserialize = classmethod(sample)
    dds_type.deserialize_key = classmethod(sample)
    return dds_type


def sample(kind: Any, cdr: bytes) -> Any:
    """Create a sample of a type returned by `sample_type` from CDR bytes."""
    instance = kind.__new__(kind)
    instance.cdr = cdr
    return instance


def _serialize(instance: Any, **_: Any) -> bytes:
    """Return the CDR bytes; replaces Cyclone's serializer, which is called with the CDR version."""
    return bytes(instance.cdr)


@cache
def idl_struct(kind: type[Message]) -> type[Any]:
    """Return an IDL struct of the same name and fields (OMG DDS-XTypes; ROS uses `pkg::msg::dds_::Name_`)."""
    name = InterfaceType(ros_type(kind), "").dds
    fields = {field.name: _idl_field(field) for field in fields_of(kind)}
    return make_idl_struct(name.rpartition("::")[2], name, fields)


def _idl_field(field: MessageField) -> Any:
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
