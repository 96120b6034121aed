"""Types without a class here: their definitions are requested from the nodes that use them (REP-2016)."""

from __future__ import annotations

import keyword
import re
from concurrent.futures import TimeoutError as NoTimeLeftError
from functools import cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.idl.cdr import HEADER
from chefbot.msgs.idl.definition import Description, FieldDescription, description_hash
from chefbot.msgs.idl.fields import NUMPY_TYPES
from chefbot.msgs.idl.message import Message, define_message
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.type_description_interfaces import (
    GetTypeDescription,
    GetTypeDescription_Request,
    IndividualTypeDescription,
    TypeDescription,
)
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.service import NoResponseError
from chefbot.ros2.tools.common import UnknownTypeError, local_definition

REQUEST_TIMEOUT = 2.0
"""Timeout of a request to one node, s."""
SERVICE = "/get_type_description"
_PRIMITIVES = {
    2: "int8", 3: "uint8", 4: "int16", 5: "uint16", 6: "int32", 7: "uint32", 8: "int64", 9: "uint64",
    10: "float32", 11: "float64", 13: "uint8", 15: "bool", 16: "byte", 17: "string", 21: "string",
}  # fmt: skip
"""Type ids of type_description_interfaces/msg/FieldType that our CDR decoder supports."""
_NESTED, _ARRAY_OFFSET, _FIXED_ARRAY, _STRING_IDS = 1, 48, 1, (17, 21)
_MAX_FIELDS, _MAX_ELEMENTS = 10_000, 1_000_000
_NAME = re.compile(r"[a-z][a-z0-9_]*")
"""Valid field names (ROS 2 interface definition); they become part of generated code, so no others are
accepted."""


def definition_of(node: RmwNode, kind: InterfaceType, what: str) -> type[Message]:
    """Return our message class of a type, or one built from the definition that a node provides.

    Raises UnknownTypeError with the type's name and hash if there is none.
    """
    try:
        return local_definition(kind, message_type, what)
    except UnknownTypeError:
        description = _request_description(node, kind)
        if description is None:
            raise
        return make_class(description)


def make_class(description: Description) -> type[Message]:
    """Build a message class from a type description.

    Raises UnknownTypeError for a field that cannot be decoded here, such as a wide string.
    """
    nested = {used.name: used for used in description.uses}

    @cache
    def build(type_description: Description) -> type[Message]:
        fields = [_field(field, lambda name: build(nested[name])) for field in type_description.fields]
        package, _, name = type_description.name.rpartition("/")
        return define_message(name, fields, package.partition("/")[0])

    try:
        return build(description._replace(uses=()))
    except (KeyError, RecursionError):
        raise UnknownTypeError(
            f"the definition of {description.name} that a node provides is inconsistent"
        ) from None


def _request_description(node: RmwNode, kind: InterfaceType) -> Description | None:
    """Return the first description received whose hash is the right one."""
    graph = node.wire.graph
    nodes = [
        endpoint.node.full_name
        for named in graph.topics().values()
        for endpoint in (*named.providers, *named.consumers)
        if endpoint.info.type == kind
    ]
    served = {name for name, service in graph.services().items() if service.providers}
    for name in dict.fromkeys(full_name + SERVICE for full_name in nodes):
        if name in served:
            description = _request_from(node, name, kind)
            if description is not None and description_hash(description) == kind.hash:
                return description
    return None


def _request_from(node: RmwNode, service: str, kind: InterfaceType) -> Description | None:
    client = node.client(service, GetTypeDescription)
    request = GetTypeDescription_Request(kind.name, kind.hash, False)
    try:
        response = client.call(request, REQUEST_TIMEOUT)
    except (NoResponseError, NoTimeLeftError):
        return None
    return _to_description(response.type_description) if response.successful else None


def _to_description(message: TypeDescription) -> Description:
    uses = tuple(_to_single_description(referenced) for referenced in message.referenced_type_descriptions)
    return _to_single_description(message.type_description)._replace(uses=uses)


def _to_single_description(message: IndividualTypeDescription) -> Description:
    fields = tuple(
        FieldDescription(
            field.name,
            field.type.type_id,
            field.type.capacity,
            field.type.string_capacity,
            field.type.nested_type_name,
        )
        for field in message.fields[:_MAX_FIELDS]
    )
    return Description(message.type_name, fields, ())


def _field(field: FieldDescription, nested: Any) -> tuple[str, Any, Any]:
    """Return name, annotation and default of a field, as `chefbot.msgs.idl.message` expects them."""
    array_form, base_id = divmod(field.type_id, _ARRAY_OFFSET)
    if array_form > 3 or not _NAME.fullmatch(field.name) or keyword.iskeyword(field.name):
        raise UnknownTypeError(f"a field {field.name!r} of type id {field.type_id} cannot be read here")
    if array_form == _FIXED_ARRAY and (base_id in _STRING_IDS or field.capacity > _MAX_ELEMENTS):
        raise UnknownTypeError(
            f"a field {field.name} that is an array of {field.capacity} such elements cannot be decoded"
        )
    size = ("", f"[{field.capacity}]", f"[<={field.capacity}]", "[]")[array_form]
    if base_id == _NESTED:
        nested_class = nested(field.nested)
        if not array_form:
            return field.name, nested_class, nested_class()
        kind: Any = tuple.__class_getitem__((nested_class, ...))
        elements = _default_elements(field, nested_class) if array_form == _FIXED_ARRAY else ()
        return field.name, Annotated[kind, size.strip("[]")] if array_form != 3 else kind, elements
    element = _PRIMITIVES.get(base_id)
    if element is None:
        raise UnknownTypeError(f"a field {field.name} of type id {field.type_id} cannot be read here")
    if element == "string":
        bound = f"<={field.string_capacity}" if base_id == 21 else ""
        default: Any = () if array_form else ""
        return field.name, Annotated[tuple[str, ...] if array_form else str, f"string{bound}{size}"], default
    number = np.dtype(NUMPY_TYPES[element])
    if array_form:
        default = np.zeros(field.capacity if array_form == _FIXED_ARRAY else 0, number)
        return field.name, Annotated[NDArray[Any], f"{element}{size}"], default
    return field.name, Annotated[type(number.type().item()), element], number.type().item()


def _default_elements(field: FieldDescription, nested: type[Message]) -> tuple[Message, ...]:
    """Return the default of an array of fixed size; elements without bytes could be nested without end."""
    element = nested()
    n_bytes = len(element.to_cdr()) - len(HEADER)
    if not 0 < n_bytes * field.capacity <= _MAX_ELEMENTS:
        raise UnknownTypeError(
            f"a field {field.name} that is an array of {field.capacity} elements of {n_bytes} bytes cannot be decoded"
        )
    return (element,) * field.capacity
