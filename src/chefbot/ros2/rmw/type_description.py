"""What the types of a node look like, for programs that have not got them: get_type_description."""

from __future__ import annotations

from typing import Any

from chefbot.msgs.idl.definition import Description, describe, description_hash, own_text
from chefbot.msgs.idl.registry import action_type, message_type, service_type
from chefbot.msgs.type_description_interfaces import (
    GetTypeDescription,
    GetTypeDescription_Response,
    TypeDescription,
    TypeSource,
)
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.service import Call


class TypeDescriptions:
    """Answers for one node, from the definitions that chefbot has."""

    def __init__(self, node: WireNode) -> None:
        node.server("~/get_type_description", GetTypeDescription, self._answer)

    def _answer(self, call: Call[Any, Any]) -> None:
        name, asked = call.request.type_name, call.request.type_hash
        try:
            description, known = _find(name)
        except KeyError as error:
            call.answer(GetTypeDescription_Response(False, str(error.args[0])))
            return
        if asked and asked != known:
            call.answer(GetTypeDescription_Response(False, f"{name} is known here with the hash {known}"))
        else:
            sources = _sources(description) if call.request.include_type_sources else ()
            call.answer(GetTypeDescription_Response(True, "", TypeDescription.of(description), sources))


def _find(name: str) -> tuple[Description, str]:
    """Description and hash of any kind of type. KeyError when there is none."""
    if "/srv/" in name:
        description = service_type(name).description
    elif "/action/" in name and "_" not in name.rpartition("/")[2]:
        description = action_type(name).description
    else:
        description = describe(message_type(name))
    return description, description_hash(description)


def _sources(description: Description) -> tuple[TypeSource, ...]:
    """As rosidl keeps them: of the type and of all that it uses, in the order of the description."""
    return tuple(_source(one.name) for one in (description, *description.uses))


def _source(name: str) -> TypeSource:
    """What its file says without comments; a type that rosidl makes of a service or action has no file."""
    _, folder, short = name.split("/")
    if folder == "msg":
        return TypeSource(name, folder, own_text(message_type(name)))
    if "_" in short:
        return TypeSource(name, "implicit", "")
    kind: Any = service_type(name) if folder == "srv" else action_type(name)
    parts = (kind.request, kind.response) if folder == "srv" else (kind.goal, kind.result, kind.feedback)
    return TypeSource(name, folder, "---\n".join(map(own_text, parts)))
