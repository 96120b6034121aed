"""Parameters of a node elsewhere in the graph: its services as functions."""

from __future__ import annotations

from typing import Any

from chefbot.errors import name_hint
from chefbot.msgs import rcl_interfaces as rcl
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.tools.common import ToolError, is_hidden, to_yaml
from chefbot.ros2.tools.service import call

TIMEOUT = 5.0
"""Timeout of one service call, s."""
FIELDS = dict(enumerate(rcl.ParameterValue.__struct_fields__[1:], rcl.BOOL))
"""Field of ParameterValue by parameter type."""


def parameter_owners(graph: Graph) -> list[str]:
    """Return the full names of the nodes that serve parameters, without hidden ones."""
    served = {name for name, service in graph.services().items() if service.providers}
    names = {node.full_name for node in graph.nodes() if not is_hidden(node.full_name)}
    return sorted(name for name in names if f"{name}/list_parameters" in served)


def parameter_names(node: RmwNode, owner: str) -> list[str]:
    """Return the names of a node's parameters. Raises ToolError if it does not answer."""
    request = rcl.ListParameters_Request()
    return sorted(call(node, f"{owner}/list_parameters", rcl.ListParameters, request, TIMEOUT).result.names)


def get_parameters(node: RmwNode, owner: str, names: list[str]) -> list[rcl.ParameterValue]:
    """Return the values of these parameters. Raises ToolError if the node does not answer."""
    request = rcl.GetParameters_Request(tuple(names))
    return list(call(node, f"{owner}/get_parameters", rcl.GetParameters, request, TIMEOUT).values)


def get_parameter(node: RmwNode, owner: str, name: str) -> rcl.ParameterValue:
    """Return the value of a parameter. Raises ToolError if there is none of this name."""
    names = parameter_names(node, owner)
    if name not in names:
        raise ToolError(f"{owner} has no parameter {name!r}{name_hint(name, names)}")
    values = get_parameters(node, owner, [name])
    if len(values) != 1 or values[0].type not in FIELDS:
        raise ToolError(f"{owner} does not return {name}")
    return values[0]


def describe_parameters(node: RmwNode, owner: str, names: list[str]) -> list[rcl.ParameterDescriptor]:
    """Return type, description and bounds of these parameters. Raises ToolError if the node does not answer."""
    request = rcl.DescribeParameters_Request(tuple(names))
    response = call(node, f"{owner}/describe_parameters", rcl.DescribeParameters, request, TIMEOUT)
    return list(response.descriptors)


def set_parameter(node: RmwNode, owner: str, name: str, value: rcl.ParameterValue) -> rcl.SetParametersResult:
    """Set a parameter and return the node's answer. Raises ToolError if there is none."""
    request = rcl.SetParameters_Request((rcl.Parameter(name, value),))
    (result,) = call(node, f"{owner}/set_parameters", rcl.SetParameters, request, TIMEOUT).results
    return rcl.SetParametersResult(result.successful, result.reason)


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
        raise ToolError(f"{name} is of type {type_text(kind)}, which {to_yaml(plain)} is not")
    if kind == rcl.STRING_ARRAY:
        plain = tuple(plain)
    field: dict[str, Any] = {FIELDS[kind]: float(plain) if kind == rcl.DOUBLE else plain}
    return rcl.ParameterValue(type=kind, **field)


def type_text(kind: int) -> str:
    """Return the name of a parameter type as people read it, such as `double array`."""
    return FIELDS[kind].removesuffix("_value").replace("_", " ")
