"""The commands `chefbot param list`, `get`, `set` and `describe`."""

from __future__ import annotations

from typing import Any

from chefbot.config import parse_yaml
from chefbot.msgs import rcl_interfaces as rcl
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.tools.common import ToolError, columns, console, find, graph_node, to_yaml
from chefbot.ros2.tools.remote_parameters import (
    FIELDS,
    describe_parameters,
    get_parameter,
    get_parameters,
    parameter_names,
    parameter_owners,
    plain_to_parameter,
    set_parameter,
    type_text,
)


def run_list(name: str) -> None:
    """Print names and values of the parameters of one node or all."""
    with graph_node("param") as node:
        nodes = [_find_owner(node.wire.graph, name)] if name else parameter_owners(node.wire.graph)
        if not nodes:
            raise ToolError("no node has parameters")
        for owner in nodes:
            names = parameter_names(node, owner)
            console.print(f"{owner}:" if names else f"{owner}: none")
            values = [to_yaml(value.plain) for value in get_parameters(node, owner, names)]
            for line in columns([parameter, value] for parameter, value in zip(names, values, strict=True)):
                console.print(f"  {line}")


def run_get(name: str, parameter: str) -> None:
    """Print the value of a parameter."""
    with graph_node("param") as node:
        owner = _find_owner(node.wire.graph, name)
        console.print(to_yaml(get_parameter(node, owner, parameter).plain))


def run_set(name: str, parameter: str, text: str) -> int:
    """Set a parameter to a value of its present type.

    Returns the exit code: 1 if the node rejects the value.
    """
    with graph_node("param") as node:
        owner = _find_owner(node.wire.graph, name)
        kind = get_parameter(node, owner, parameter).type
        value = plain_to_parameter(kind, parse_yaml(text.encode(), f"value of {parameter}"), parameter)
        result = set_parameter(node, owner, parameter, value)
        if result.successful:
            console.print(f"{owner} {parameter}: {to_yaml(value.plain)}")
        else:
            console.print(f"{owner} refuses {parameter}: {result.reason or 'no reason given'}")
        return 0 if result.successful else 1


def run_describe(name: str, parameter: str) -> None:
    """Print the type, description and bounds of a parameter."""
    with graph_node("param") as node:
        owner = _find_owner(node.wire.graph, name)
        get_parameter(node, owner, parameter)
        (descriptor,) = describe_parameters(node, owner, [parameter])
        for line in describe_lines(descriptor):
            console.print(line)


def describe_lines(descriptor: rcl.ParameterDescriptor) -> list[str]:
    """Return the lines that `param describe` prints."""
    kind = type_text(descriptor.type) if descriptor.type in FIELDS else "not set"
    lines = [f"{descriptor.name}: {kind}{', read only' if descriptor.read_only else ''}"]
    lines += [f"  {text}" for text in (descriptor.description, descriptor.additional_constraints) if text]
    bounds: tuple[Any, ...] = (*descriptor.floating_point_range, *descriptor.integer_range)
    for bound in bounds:
        lines.append(
            f"  from {bound.from_value} to {bound.to_value}{f', step {bound.step}' if bound.step else ''}"
        )
    return lines


def _find_owner(graph: Graph, name: str) -> str:
    found = find(lambda: {node.full_name: node for node in graph.nodes()}, name, "node").full_name
    if found not in parameter_owners(graph):
        raise ToolError(f"node {found} has no parameters")
    return found
