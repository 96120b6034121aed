"""type_description_interfaces: descriptions of interface types as messages."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from typing import Annotated

from chefbot.msgs.idl.definition import Description
from chefbot.msgs.idl.message import Bool, Message, String, Uint8, Uint64
from chefbot.msgs.idl.service import define_service

TypeName = Annotated[str, "string<=255"]


class FieldType(Message, frozen=True, eq=False):
    """The type of a field, with type IDs as in RIHS01 (REP-2016)."""

    type_id: Uint8 = 0
    capacity: Uint64 = 0
    string_capacity: Uint64 = 0
    nested_type_name: TypeName = ""


class Field(Message, frozen=True, eq=False):
    """One field of an interface type."""

    name: String = ""
    type: FieldType = FieldType()
    default_value: String = ""


class IndividualTypeDescription(Message, frozen=True, eq=False):
    """The description of one type without the types that it uses."""

    type_name: TypeName = ""
    fields: tuple[Field, ...] = ()


class TypeDescription(Message, frozen=True, eq=False):
    """The description of a type and of all types that it uses."""

    type_description: IndividualTypeDescription = IndividualTypeDescription()
    referenced_type_descriptions: tuple[IndividualTypeDescription, ...] = ()

    @staticmethod
    def of(description: Description) -> TypeDescription:
        """Create the message from our own type description."""
        return TypeDescription(
            _individual(description), tuple(_individual(used) for used in description.uses)
        )


class TypeSource(Message, frozen=True, eq=False):
    """The source file of a type."""

    type_name: String = ""
    encoding: String = ""
    raw_file_contents: String = ""


class KeyValue(Message, frozen=True, eq=False):
    """A named string of additional information."""

    key: String = ""
    value: String = ""


class GetTypeDescription_Request(Message, frozen=True, eq=False):
    """A request for the description of a type with a given hash."""

    type_name: String = ""
    type_hash: String = ""
    include_type_sources: Bool = True


class GetTypeDescription_Response(Message, frozen=True, eq=False):
    """The description of the type, or the reason why it is not available."""

    successful: Bool = False
    failure_reason: String = ""
    type_description: TypeDescription = TypeDescription()
    type_sources: tuple[TypeSource, ...] = ()
    extra_information: tuple[KeyValue, ...] = ()


GetTypeDescription = define_service(GetTypeDescription_Request, GetTypeDescription_Response)


def _individual(description: Description) -> IndividualTypeDescription:
    fields = (
        Field(field.name, FieldType(field.type_id, field.capacity, field.string_capacity, field.nested))
        for field in description.fields
    )
    return IndividualTypeDescription(description.name, tuple(fields))
