"""Types that we have no class of: the node that has one is asked for its definition, as REP-2016 lets one do."""

from __future__ import annotations

import keyword
import re
from concurrent.futures import TimeoutError as NoTimeLeftError
from functools import cache
from typing import Annotated, Any, cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.msgs.idl.definition import Description, FieldDescription, description_hash
from chefbot.msgs.idl.fields import NUMPY_TYPES
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.type_description_interfaces import (
    GetTypeDescription,
    GetTypeDescription_Request,
    IndividualTypeDescription,
    TypeDescription,
)
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.service import NoAnswerError
from chefbot.ros2.tools.common import definition

ASK_TIMEOUT = 2.0
"""Seconds for one node."""
SERVICE = "/get_type_description"
_PRIMITIVES = {
    2: "int8", 3: "uint8", 4: "int16", 5: "uint16", 6: "int32", 7: "uint32", 8: "int64", 9: "uint64",
    10: "float32", 11: "float64", 13: "uint8", 15: "bool", 16: "byte", 17: "string", 21: "string",
}  # fmt: skip
"""Ids of type_description_interfaces/msg/FieldType that CDR here can carry."""
_NESTED, _STEP, _FIXED, _TEXTS = 1, 48, 1, (17, 21)
_MOST_FIELDS, _MOST_ELEMENTS = 10_000, 1_000_000
_NAME = re.compile(r"[a-z][a-z0-9_]*")
"""Of fields (ROS 2's interface definition); they become part of a program, so nothing else passes."""


def definition_of(node: WireNode, kind: WireType, what: str) -> type[Message]:
    """Our class, or one made of what a node tells. UserError, with the type's name and hash, if there is none."""
    try:
        return definition(kind, message_type, what)
    except UserError:
        told = _ask(node, kind)
        if told is None:
            raise
        return make_class(told)


def make_class(description: Description) -> type[Message]:
    """A message class of these fields. UserError for a field that cannot be read here, such as a wide text."""
    below = {one.name: one for one in description.uses}

    @cache
    def build(one: Description) -> type[Message]:
        fields = [_field(field, lambda name: build(below[name])) for field in one.fields]
        package, _, name = one.name.rpartition("/")
        module = package.partition("/")[0]
        return cast(
            type[Message],
            msgspec.defstruct(name, fields, bases=(Message,), module=module, frozen=True, eq=False),
        )

    try:
        return build(description._replace(uses=()))
    except (KeyError, RecursionError):
        raise UserError(
            f"the definition of {description.name} that a node tells contradicts itself"
        ) from None


def _ask(node: WireNode, kind: WireType) -> Description | None:
    """The first answer whose hash is the right one."""
    graph = node.wire.graph
    speakers = [
        end.node.full_name
        for named in graph.topics().values()
        for end in (*named.givers, *named.takers)
        if end.end.type == kind
    ]
    served = {name for name, one in graph.services().items() if one.givers}
    for name in dict.fromkeys(one + SERVICE for one in speakers):
        if name in served:
            told = _ask_one(node, name, kind)
            if told is not None and description_hash(told) == kind.hash:
                return told
    return None


def _ask_one(node: WireNode, service: str, kind: WireType) -> Description | None:
    client = node.client(service, GetTypeDescription)
    request = GetTypeDescription_Request(kind.name, kind.hash, False)
    try:
        answer = client.call(request, ASK_TIMEOUT)
    except (NoAnswerError, NoTimeLeftError):
        return None
    return _read(answer.type_description) if answer.successful else None


def _read(told: TypeDescription) -> Description:
    uses = tuple(_read_one(one) for one in told.referenced_type_descriptions)
    return _read_one(told.type_description)._replace(uses=uses)


def _read_one(told: IndividualTypeDescription) -> Description:
    fields = tuple(
        FieldDescription(
            one.name, one.type.type_id, one.type.capacity, one.type.string_capacity, one.type.nested_type_name
        )
        for one in told.fields[:_MOST_FIELDS]
    )
    return Description(told.type_name, fields, ())


def _field(field: FieldDescription, nested: Any) -> tuple[str, Any, Any]:
    """Name, annotation and default, as `chefbot.msgs.idl.message` wants them."""
    form, base = divmod(field.type_id, _STEP)
    if form > 3 or not _NAME.fullmatch(field.name) or keyword.iskeyword(field.name):
        raise UserError(f"a field {field.name!r} of type id {field.type_id} cannot be read here")
    if form == _FIXED and (base not in _PRIMITIVES or base in _TEXTS or field.capacity > _MOST_ELEMENTS):
        raise UserError(
            f"a field {field.name} that is an array of {field.capacity} such things cannot be read here"
        )
    size = ("", f"[{field.capacity}]", f"[<={field.capacity}]", "[]")[form]
    if base == _NESTED:
        below = nested(field.nested)
        if not form:
            return field.name, below, below()
        kind: Any = tuple.__class_getitem__((below, ...))
        return field.name, Annotated[kind, size.strip("[]")] if form != 3 else kind, ()
    element = _PRIMITIVES.get(base)
    if element is None:
        raise UserError(f"a field {field.name} of type id {field.type_id} cannot be read here")
    if element == "string":
        bound = f"<={field.string_capacity}" if base == 21 else ""
        default: Any = () if form else ""
        return field.name, Annotated[tuple[str, ...] if form else str, f"string{bound}{size}"], default
    number = np.dtype(NUMPY_TYPES[element])
    if form:
        default = np.zeros(field.capacity if form == _FIXED else 0, number)
        return field.name, Annotated[NDArray[Any], f"{element}{size}"], default
    return field.name, Annotated[type(number.type().item()), element], number.type().item()
