"""The get_type_description service (REP-2016): definitions of a node's types for programs without them."""

from __future__ import annotations

from typing import Any

from chefbot.msgs.idl.definition import Description, describe, description_hash, interface_text
from chefbot.msgs.idl.registry import action_type, message_type, service_type
from chefbot.msgs.type_description_interfaces import (
    GetTypeDescription,
    GetTypeDescription_Response,
    TypeDescription,
    TypeSource,
)
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.service import ServiceCall


def serve_type_descriptions(node: RmwNode) -> None:
    """Serve the get_type_description service of a node from chefbot's own definitions."""
    node.server("~/get_type_description", GetTypeDescription, _answer)


def _answer(call: ServiceCall[Any, Any]) -> None:
    name, requested_hash = call.request.type_name, call.request.type_hash
    try:
        description, type_hash = _find(name)
    except KeyError as error:
        call.respond(GetTypeDescription_Response(False, str(error.args[0])))
        return
    if requested_hash and requested_hash != type_hash:
        call.respond(GetTypeDescription_Response(False, f"{name} is known with the hash {type_hash}"))
    else:
        sources = _sources(description) if call.request.include_type_sources else ()
        call.respond(GetTypeDescription_Response(True, "", TypeDescription.of(description), sources))


def _find(name: str) -> tuple[Description, str]:
    """Return description and hash of a message, service or action type; raises KeyError when unknown."""
    if "/srv/" in name:
        description = service_type(name).description
    elif "/action/" in name and "_" not in name.rpartition("/")[2]:
        description = action_type(name).description
    else:
        description = describe(message_type(name))
    return description, description_hash(description)


def _sources(description: Description) -> tuple[TypeSource, ...]:
    """Return the sources of the type and of all types it uses, in the description's order (as rosidl)."""
    return tuple(_source(used.name) for used in (description, *description.uses))


def _source(name: str) -> TypeSource:
    """Return the definition text without comments.

    Types that rosidl derives from services and actions have none.
    """
    _, folder, short = name.split("/")
    if folder == "msg":
        return TypeSource(name, folder, interface_text(message_type(name)))
    if "_" in short:
        return TypeSource(name, "implicit", "")
    kind: Any = service_type(name) if folder == "srv" else action_type(name)
    parts = (kind.request, kind.response) if folder == "srv" else (kind.goal, kind.result, kind.feedback)
    return TypeSource(name, folder, "---\n".join(map(interface_text, parts)))
