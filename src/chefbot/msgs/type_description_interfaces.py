"""type_description_interfaces: types told as messages."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from typing import Annotated

from chefbot.msgs.idl.definition import Description
from chefbot.msgs.idl.message import Bool, Message, String, Uint8, Uint64
from chefbot.msgs.idl.service import define_service

TypeName = Annotated[str, "string<=255"]


class FieldType(Message, frozen=True, eq=False):
    """What a field holds; ids as in RIHS01."""

    type_id: Uint8 = 0
    capacity: Uint64 = 0
    string_capacity: Uint64 = 0
    nested_type_name: TypeName = ""


class Field(Message, frozen=True, eq=False):
    """One field of a type."""

    name: String = ""
    type: FieldType = FieldType()
    default_value: String = ""


class IndividualTypeDescription(Message, frozen=True, eq=False):
    """One type without those below it."""

    type_name: TypeName = ""
    fields: tuple[Field, ...] = ()


class TypeDescription(Message, frozen=True, eq=False):
    """A type and all below it."""

    type_description: IndividualTypeDescription = IndividualTypeDescription()
    referenced_type_descriptions: tuple[IndividualTypeDescription, ...] = ()

    @staticmethod
    def of(description: Description) -> TypeDescription:
        """From our own words for the same."""
        return TypeDescription(_individual(description), tuple(_individual(one) for one in description.uses))


class TypeSource(Message, frozen=True, eq=False):
    """The file that a type was read from."""

    type_name: String = ""
    encoding: String = ""
    raw_file_contents: String = ""


class KeyValue(Message, frozen=True, eq=False):
    """A named text."""

    key: String = ""
    value: String = ""


class GetTypeDescription_Request(Message, frozen=True, eq=False):
    """Which type, with its hash."""

    type_name: String = ""
    type_hash: String = ""
    include_type_sources: Bool = True


class GetTypeDescription_Response(Message, frozen=True, eq=False):
    """What it is, or why that is not known."""

    successful: Bool = False
    failure_reason: String = ""
    type_description: TypeDescription = TypeDescription()
    type_sources: tuple[TypeSource, ...] = ()
    extra_information: tuple[KeyValue, ...] = ()


GetTypeDescription = define_service(GetTypeDescription_Request, GetTypeDescription_Response)


def _individual(description: Description) -> IndividualTypeDescription:
    fields = (
        Field(one.name, FieldType(one.type_id, one.capacity, one.string_capacity, one.nested))
        for one in description.fields
    )
    return IndividualTypeDescription(description.name, tuple(fields))
