"""`chefbot param list`, `get`, `set` and `describe`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from chefbot.config import parse_yaml
from chefbot.errors import UserError, nearest
from chefbot.msgs import rcl_interfaces as rcl
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.tools.common import columns, console, find, hidden, on_wire, to_yaml
from chefbot.ros2.tools.service import call

TIMEOUT = 5.0
"""Seconds for one answer."""


class _Form(NamedTuple):
    """One of the nine types of a parameter."""

    name: str
    field: str


FORMS = {
    rcl.BOOL: _Form("bool", "bool_value"),
    rcl.INTEGER: _Form("integer", "integer_value"),
    rcl.DOUBLE: _Form("double", "double_value"),
    rcl.STRING: _Form("string", "string_value"),
    rcl.BYTE_ARRAY: _Form("byte array", "byte_array_value"),
    rcl.BOOL_ARRAY: _Form("bool array", "bool_array_value"),
    rcl.INTEGER_ARRAY: _Form("integer array", "integer_array_value"),
    rcl.DOUBLE_ARRAY: _Form("double array", "double_array_value"),
    rcl.STRING_ARRAY: _Form("string array", "string_array_value"),
}


def run_list(name: str) -> None:
    """Names and values, of one node or all."""
    with on_wire("param") as node:
        nodes = [_owner(node.wire.graph, name)] if name else _owners(node.wire.graph)
        if not nodes:
            raise UserError("no node on the wire has parameters")
        for one in nodes:
            names = _names(node, one)
            console.print(f"{one}:" if names else f"{one}: none")
            values = [to_yaml(plain_value(value)) for value in _get(node, one, names)]
            for line in columns([known, value] for known, value in zip(names, values, strict=True)):
                console.print(f"  {line}")


def run_get(name: str, parameter: str) -> None:
    """One value."""
    with on_wire("param") as node:
        owner = _owner(node.wire.graph, name)
        console.print(to_yaml(plain_value(_one(node, owner, parameter))))


def run_set(name: str, parameter: str, text: str) -> int:
    """A new value, of the type that the old one has. Exit code: 1 if the node refuses it."""
    with on_wire("param") as node:
        owner = _owner(node.wire.graph, name)
        kind = _one(node, owner, parameter).type
        value = wire_value(kind, parse_yaml(text.encode(), f"value of {parameter}"), parameter)
        request = rcl.SetParameters_Request((rcl.Parameter(parameter, value),))
        (done,) = call(node, f"{owner}/set_parameters", rcl.SetParameters, request, TIMEOUT).results
        if done.successful:
            console.print(f"{owner} {parameter}: {to_yaml(plain_value(value))}")
        else:
            console.print(f"{owner} refuses {parameter}: {done.reason or 'it does not say why'}")
        return 0 if done.successful else 1


def run_describe(name: str, parameter: str) -> None:
    """Type, sentence and bounds."""
    with on_wire("param") as node:
        owner = _owner(node.wire.graph, name)
        _one(node, owner, parameter)
        request = rcl.DescribeParameters_Request((parameter,))
        (told,) = call(
            node, f"{owner}/describe_parameters", rcl.DescribeParameters, request, TIMEOUT
        ).descriptors
        for line in describe_lines(told):
            console.print(line)


def describe_lines(told: rcl.ParameterDescriptor) -> list[str]:
    """What `param describe` prints."""
    form = FORMS.get(told.type)
    lines = [f"{told.name}: {form.name if form else 'not set'}{', read only' if told.read_only else ''}"]
    lines += [f"  {text}" for text in (told.description, told.additional_constraints) if text]
    bounds: tuple[Any, ...] = (*told.floating_point_range, *told.integer_range)
    for one in bounds:
        lines.append(f"  from {one.from_value} to {one.to_value}{f', step {one.step}' if one.step else ''}")
    return lines


def plain_value(value: rcl.ParameterValue) -> Any:
    """As YAML has it; null for one that is not set."""
    form = FORMS.get(value.type)
    if form is None:
        return None
    plain = getattr(value, form.field)
    return (
        plain.tolist()
        if isinstance(plain, np.ndarray)
        else list(plain)
        if isinstance(plain, tuple)
        else plain
    )


def wire_value(kind: int, plain: Any, name: str) -> rcl.ParameterValue:
    """Of the type `kind`. UserError when `plain` is of another."""
    wanted: dict[int, Any] = {rcl.BOOL: bool, rcl.INTEGER: int, rcl.DOUBLE: (int, float), rcl.STRING: str}
    single = {rcl.BYTE_ARRAY: rcl.INTEGER}.get(kind, kind - rcl.BOOL_ARRAY + rcl.BOOL)
    array = kind in FORMS and kind >= rcl.BYTE_ARRAY
    one = wanted[single if array else kind]
    values = plain if array and isinstance(plain, list) else [plain]
    fits = all(isinstance(value, one) and (one is bool or not isinstance(value, bool)) for value in values)
    if not fits or isinstance(plain, list) != array:
        raise UserError(f"{name} is of type {FORMS[kind].name}, which {to_yaml(plain)} is not")
    if kind in (rcl.STRING_ARRAY,):
        plain = tuple(plain)
    held: dict[str, Any] = {FORMS[kind].field: float(plain) if kind == rcl.DOUBLE else plain}
    return rcl.ParameterValue(type=kind, **held)


def _owners(graph: Graph) -> list[str]:
    served = {name for name, one in graph.services().items() if one.givers}
    names = {one.full_name for one in graph.nodes() if not hidden(one.full_name)}
    return sorted(one for one in names if f"{one}/list_parameters" in served)


def _owner(graph: Graph, name: str) -> str:
    found = find(lambda: {one.full_name: one for one in graph.nodes()}, name, "node").full_name
    if found not in _owners(graph):
        raise UserError(f"node {found} has no parameters")
    return found


def _names(node: WireNode, owner: str) -> list[str]:
    request = rcl.ListParameters_Request()
    return sorted(call(node, f"{owner}/list_parameters", rcl.ListParameters, request, TIMEOUT).result.names)


def _get(node: WireNode, owner: str, names: list[str]) -> list[rcl.ParameterValue]:
    request = rcl.GetParameters_Request(tuple(names))
    return list(call(node, f"{owner}/get_parameters", rcl.GetParameters, request, TIMEOUT).values)


def _one(node: WireNode, owner: str, parameter: str) -> rcl.ParameterValue:
    names = _names(node, owner)
    if parameter not in names:
        raise UserError(f"{owner} has no parameter {parameter!r}{nearest(parameter, names)}")
    values = _get(node, owner, [parameter])
    if len(values) != 1 or values[0].type not in FORMS:
        raise UserError(f"{owner} does not tell {parameter}")
    return values[0]
