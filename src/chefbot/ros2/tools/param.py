"""The commands `chefbot param list`, `get`, `set` and `describe`."""

from __future__ import annotations

from typing import Any

from chefbot.config import parse_yaml
from chefbot.errors import name_hint
from chefbot.msgs import rcl_interfaces as rcl
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.tools.common import ToolError, columns, console, find, graph_node, is_hidden, to_yaml
from chefbot.ros2.tools.service import call

TIMEOUT = 5.0
"""Timeout of one service call, s."""


FIELDS = dict(enumerate(rcl.ParameterValue.__struct_fields__[1:], rcl.BOOL))
"""Field of ParameterValue by parameter type."""


def run_list(name: str) -> None:
    """Print names and values of the parameters of one node or all."""
    with graph_node("param") as node:
        nodes = [_find_owner(node.wire.graph, name)] if name else _owners(node.wire.graph)
        if not nodes:
            raise ToolError("no node has parameters")
        for owner in nodes:
            names = _names(node, owner)
            console.print(f"{owner}:" if names else f"{owner}: none")
            values = [to_yaml(value.plain) for value in _get(node, owner, names)]
            for line in columns([parameter, value] for parameter, value in zip(names, values, strict=True)):
                console.print(f"  {line}")


def run_get(name: str, parameter: str) -> None:
    """Print the value of a parameter."""
    with graph_node("param") as node:
        owner = _find_owner(node.wire.graph, name)
        console.print(to_yaml(_get_one(node, owner, parameter).plain))


def run_set(name: str, parameter: str, text: str) -> int:
    """Set a parameter to a value of its present type.

    Returns the exit code: 1 if the node rejects the value.
    """
    with graph_node("param") as node:
        owner = _find_owner(node.wire.graph, name)
        kind = _get_one(node, owner, parameter).type
        value = plain_to_parameter(kind, parse_yaml(text.encode(), f"value of {parameter}"), parameter)
        request = rcl.SetParameters_Request((rcl.Parameter(parameter, value),))
        (result,) = call(node, f"{owner}/set_parameters", rcl.SetParameters, request, TIMEOUT).results
        if result.successful:
            console.print(f"{owner} {parameter}: {to_yaml(value.plain)}")
        else:
            console.print(f"{owner} refuses {parameter}: {result.reason or 'no reason given'}")
        return 0 if result.successful else 1


def run_describe(name: str, parameter: str) -> None:
    """Print the type, description and bounds of a parameter."""
    with graph_node("param") as node:
        owner = _find_owner(node.wire.graph, name)
        _get_one(node, owner, parameter)
        request = rcl.DescribeParameters_Request((parameter,))
        (descriptor,) = call(
            node, f"{owner}/describe_parameters", rcl.DescribeParameters, request, TIMEOUT
        ).descriptors
        for line in describe_lines(descriptor):
            console.print(line)


def describe_lines(descriptor: rcl.ParameterDescriptor) -> list[str]:
    """Return the lines that `param describe` prints."""
    kind = _type_name(descriptor.type) if descriptor.type in FIELDS else "not set"
    lines = [f"{descriptor.name}: {kind}{', read only' if descriptor.read_only else ''}"]
    lines += [f"  {text}" for text in (descriptor.description, descriptor.additional_constraints) if text]
    bounds: tuple[Any, ...] = (*descriptor.floating_point_range, *descriptor.integer_range)
    for bound in bounds:
        lines.append(
            f"  from {bound.from_value} to {bound.to_value}{f', step {bound.step}' if bound.step else ''}"
        )
    return lines


def plain_to_parameter(kind: int, plain: Any, name: str) -> rcl.ParameterValue:
    """Convert plain data to a parameter value of the type `kind`; raises ToolError for another type."""
    types: dict[int, Any] = {rcl.BOOL: bool, rcl.INTEGER: int, rcl.DOUBLE: (int, float), rcl.STRING: str}
    single = {rcl.BYTE_ARRAY: rcl.INTEGER}.get(kind, kind - rcl.BOOL_ARRAY + rcl.BOOL)
    array = kind in FIELDS and kind >= rcl.BYTE_ARRAY
    expected = types[single if array else kind]
    values = plain if array and isinstance(plain, list) else [plain]
    fits = all(
        isinstance(value, expected) and (expected is bool or not isinstance(value, bool)) for value in values
    )
    if not fits or isinstance(plain, list) != array:
        raise ToolError(f"{name} is of type {_type_name(kind)}, which {to_yaml(plain)} is not")
    if kind == rcl.STRING_ARRAY:
        plain = tuple(plain)
    field: dict[str, Any] = {FIELDS[kind]: float(plain) if kind == rcl.DOUBLE else plain}
    return rcl.ParameterValue(type=kind, **field)


def _type_name(kind: int) -> str:
    return FIELDS[kind].removesuffix("_value").replace("_", " ")


def _owners(graph: Graph) -> list[str]:
    served = {name for name, service in graph.services().items() if service.providers}
    names = {node.full_name for node in graph.nodes() if not is_hidden(node.full_name)}
    return sorted(name for name in names if f"{name}/list_parameters" in served)


def _find_owner(graph: Graph, name: str) -> str:
    found = find(lambda: {node.full_name: node for node in graph.nodes()}, name, "node").full_name
    if found not in _owners(graph):
        raise ToolError(f"node {found} has no parameters")
    return found


def _names(node: RmwNode, owner: str) -> list[str]:
    request = rcl.ListParameters_Request()
    return sorted(call(node, f"{owner}/list_parameters", rcl.ListParameters, request, TIMEOUT).result.names)


def _get(node: RmwNode, owner: str, names: list[str]) -> list[rcl.ParameterValue]:
    request = rcl.GetParameters_Request(tuple(names))
    return list(call(node, f"{owner}/get_parameters", rcl.GetParameters, request, TIMEOUT).values)


def _get_one(node: RmwNode, owner: str, parameter: str) -> rcl.ParameterValue:
    names = _names(node, owner)
    if parameter not in names:
        raise ToolError(f"{owner} has no parameter {parameter!r}{name_hint(parameter, names)}")
    values = _get(node, owner, [parameter])
    if len(values) != 1 or values[0].type not in FIELDS:
        raise ToolError(f"{owner} does not return {parameter}")
    return values[0]
