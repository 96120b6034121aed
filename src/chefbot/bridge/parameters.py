"""Parameters of a node as ROS 2's tools see them: a param struct, flattened to dotted names."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any

import msgspec
import numpy as np
from msgspec import inspect as types

from chefbot.errors import name_hint
from chefbot.msgs import rcl_interfaces as rcl
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import PARAMETERS
from chefbot.ros2.rmw.service import ServiceCall
from chefbot.runtime.live_params import is_live
from chefbot.runtime.param_values import ParameterInfo, flatten, is_secret

SIM_TIME = "use_sim_time"
FLOAT_MAX = 1.7976931348623157e308
INT_MAX = 2**63 - 1
Setter = Callable[[dict[str, Any], Callable[[str], None]], None]
"""`setter(values by dotted name, done)`: calls `done("")` once they are set, or `done(reason)`; from any
thread."""


class ParameterServices:
    """The parameter services of one node; `read()` returns its current params.

    `use_sim_time` is one of them, as ROS 2's tools expect. `live`: patterns of those that can be set at run
    time; the others are reported as read-only.
    """

    def __init__(
        self,
        node: RmwNode,
        read: Callable[[], msgspec.Struct],
        setter: Setter,
        *,
        live: tuple[str, ...],
        simulated: bool,
    ) -> None:
        self._read, self._setter, self._live, self._simulated = read, setter, live, simulated
        for name, service, handler in (
            ("list_parameters", rcl.ListParameters, self._list),
            ("get_parameters", rcl.GetParameters, self._get),
            ("get_parameter_types", rcl.GetParameterTypes, self._get_types),
            ("describe_parameters", rcl.DescribeParameters, self._describe),
            ("set_parameters", rcl.SetParameters, self._set),
            ("set_parameters_atomically", rcl.SetParametersAtomically, self._set_atomically),
        ):
            node.server(f"~/{name}", service, handler, PARAMETERS)

    def _all(self) -> dict[str, ParameterInfo]:
        shown = {name: info for name, info in flatten(self._read()).items() if not is_secret(info)}
        return {**shown, SIM_TIME: ParameterInfo(self._simulated, types.type_info(bool))}

    def _list(self, call: ServiceCall[Any, Any]) -> None:
        prefixes, depth = call.request.prefixes, call.request.depth
        names = [name for name in sorted(self._all()) if _matches(name, prefixes, depth)]
        prefix_names = sorted({name.rpartition(".")[0] for name in names if "." in name})
        call.respond(rcl.ListParameters_Response(rcl.ListParametersResult(tuple(names), tuple(prefix_names))))

    def _get(self, call: ServiceCall[Any, Any]) -> None:
        parameters = self._all()
        values = (
            to_value(parameters[n].value) if n in parameters else rcl.ParameterValue()
            for n in call.request.names
        )
        call.respond(rcl.GetParameters_Response(tuple(values)))

    def _get_types(self, call: ServiceCall[Any, Any]) -> None:
        parameters = self._all()
        kinds = [to_value(parameters[n].value).type if n in parameters else 0 for n in call.request.names]
        call.respond(rcl.GetParameterTypes_Response(np.array(kinds, np.uint8)))

    def _describe(self, call: ServiceCall[Any, Any]) -> None:
        parameters = self._all()
        descriptors = (
            _descriptor(n, parameters[n], is_live(n, self._live))
            for n in call.request.names
            if n in parameters
        )
        call.respond(rcl.DescribeParameters_Response(tuple(descriptors)))

    def _set(self, call: ServiceCall[Any, Any]) -> None:
        """Set the parameters in order; respond when the last is done."""
        self._set_next(call, list(call.request.parameters), [])

    def _set_next(
        self,
        call: ServiceCall[Any, Any],
        remaining: list[rcl.Parameter],
        results: list[rcl.SetParametersResult],
    ) -> None:
        if not remaining:
            call.respond(rcl.SetParameters_Response(tuple(results)))
            return

        def done(reason: str) -> None:
            self._set_next(call, remaining[1:], [*results, rcl.SetParametersResult(not reason, reason)])

        self._check_and_set(remaining[:1], done)

    def _set_atomically(self, call: ServiceCall[Any, Any]) -> None:
        def done(reason: str) -> None:
            call.respond(rcl.SetParametersAtomically_Response(rcl.SetParametersResult(not reason, reason)))

        self._check_and_set(list(call.request.parameters), done)

    def _check_and_set(self, parameters: Iterable[rcl.Parameter], done: Callable[[str], None]) -> None:
        existing = self._all()
        for parameter in parameters:
            if parameter.name not in existing:
                done(f"there is no parameter {parameter.name!r}{name_hint(parameter.name, existing)}")
                return
            if parameter.name == SIM_TIME:
                done(f"{parameter.name} cannot be changed: it is set by the launch")
                return
        self._setter({parameter.name: parameter.value.plain for parameter in parameters}, done)


def to_value(value: Any) -> rcl.ParameterValue:
    """Convert a plain value to a ROS parameter value."""
    if isinstance(value, bool):
        return rcl.ParameterValue(rcl.BOOL, bool_value=value)
    if isinstance(value, int):
        return rcl.ParameterValue(rcl.INTEGER, integer_value=value)
    if isinstance(value, float):
        return rcl.ParameterValue(rcl.DOUBLE, double_value=value)
    if isinstance(value, (list, tuple)) and (array := _array_value(value)) is not None:
        return array
    text = value if isinstance(value, str) else json.dumps(msgspec.to_builtins(value))
    return rcl.ParameterValue(rcl.STRING, string_value=text)


def _array_value(items: list[Any] | tuple[Any, ...]) -> rcl.ParameterValue | None:
    """Return an array parameter; None for items that no array of ROS holds."""
    kinds = {type(item) for item in items}
    if kinds <= {str}:
        return rcl.ParameterValue(rcl.STRING_ARRAY, string_array_value=tuple(items))
    if kinds == {bool}:
        return rcl.ParameterValue(rcl.BOOL_ARRAY, bool_array_value=np.array(items, np.bool_))
    if kinds == {int}:
        return rcl.ParameterValue(rcl.INTEGER_ARRAY, integer_array_value=np.array(items, np.int64))
    if kinds <= {int, float}:
        return rcl.ParameterValue(rcl.DOUBLE_ARRAY, double_array_value=np.array(items, np.float64))
    return None


def _descriptor(name: str, parameter: ParameterInfo, live: bool) -> rcl.ParameterDescriptor:
    kind, description = parameter.kind, ""
    if isinstance(kind, types.Metadata):
        description, kind = _description(kind), kind.type
    floats: tuple[rcl.FloatingPointRange, ...] = ()
    integers: tuple[rcl.IntegerRange, ...] = ()
    if isinstance(kind, types.FloatType):
        floats = tuple(rcl.FloatingPointRange(low, high) for low, high in _bounds(kind, FLOAT_MAX))
    elif isinstance(kind, types.IntType):
        integers = tuple(rcl.IntegerRange(int(low), int(high)) for low, high in _bounds(kind, INT_MAX))
    return rcl.ParameterDescriptor(
        name,
        to_value(parameter.value).type,
        description,
        additional_constraints="" if live or name == SIM_TIME else "read when the node starts",
        read_only=not live or name == SIM_TIME,
        floating_point_range=floats,
        integer_range=integers,
    )


def _description(kind: types.Metadata) -> str:
    schema, extra = kind.extra_json_schema or {}, kind.extra or {}
    return ", ".join(text for text in (schema.get("description", ""), extra.get("unit", "")) if text)


def _bounds(kind: types.FloatType | types.IntType, limit: float) -> list[tuple[float, float]]:
    """Return one range, or none if the number is unbounded: tools make sliders of ranges."""
    low = kind.ge if kind.ge is not None else kind.gt
    high = kind.le if kind.le is not None else kind.lt
    if low is None and high is None:
        return []
    return [(-limit if low is None else low, limit if high is None else high)]


def _matches(name: str, prefixes: tuple[str, ...], depth: int) -> bool:
    if not prefixes:
        return depth == 0 or name.count(".") < depth
    return any(
        name == prefix
        or (name.startswith(prefix + ".") and (depth == 0 or name[len(prefix) + 1 :].count(".") < depth))
        for prefix in prefixes
    )
