"""The commands `chefbot service list` and `call`."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import TimeoutError as NoTimeLeftError
from typing import Any

from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import service_type
from chefbot.msgs.idl.service import Service
from chefbot.msgs.idl.yaml_conversion import message_from_dict, message_to_dict
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.service import NoResponseError
from chefbot.ros2.tools.common import (
    ToolError,
    console,
    find,
    graph_node,
    is_hidden,
    local_definition,
    only_type,
    print_with_servers,
    to_yaml,
    type_and_values,
    type_name,
)

SERVED_WAIT = 2.0
"""Maximum time to find a server, s."""


def run_list(verbose: bool, include_hidden: bool) -> None:
    """Print one service name per line; with types and servers if `verbose`."""
    with graph_node("service") as node:
        services = node.wire.graph.services().values()
        print_with_servers(
            [service for service in services if include_hidden or not is_hidden(service.name)], verbose
        )


def run_call(name: str, arguments: Sequence[str], timeout: float) -> None:
    """Call a service and print the response as YAML."""
    type_given, values = type_and_values(arguments)
    with graph_node("service") as node:
        named = find(node.wire.graph.services, name, "service")
        kind = only_type(named, "service")
        if type_given and type_name(type_given, "srv") != kind.name:
            raise ToolError(f"service {named.name} is a {kind.name}, not a {type_given}")
        service = local_definition(kind, service_type, f"service {named.name}")
        request = message_from_dict(service.request, values, f"values for {named.name}")
        console.print(to_yaml(message_to_dict(call(node, named.name, service, request, timeout))))


def call(node: RmwNode, name: str, service: Service[Any, Any], request: Message, timeout: float) -> Any:
    """Call a service and return the response.

    Raises ToolError when there is no response in time, or the server refuses.
    """
    client = node.client(name, service)
    deadline = time.monotonic() + min(SERVED_WAIT, timeout)
    try:
        while not client.server_is_ready and time.monotonic() < deadline:
            time.sleep(0.01)
        return client.call(request, timeout)
    except NoResponseError as error:
        raise ToolError(str(error)) from None
    except NoTimeLeftError:
        raise ToolError(f"service {name} gave no answer in {timeout:g} s") from None
    finally:
        node.destroy(client)
