"""Parameters of nodes that are watched: read again and again, and set, in a thread of their own."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple

import msgspec

from chefbot.msgs import rcl_interfaces as rcl
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.tools.common import ToolError, to_yaml
from chefbot.ros2.tools.inspection_views import NodeParameters, ParameterView
from chefbot.ros2.tools.remote_parameters import (
    FIELDS,
    describe_parameters,
    get_parameter,
    get_parameters,
    parameter_names,
    plain_to_parameter,
    set_parameter,
    type_text,
)

MAX_BOUND = 1e15
"""Bound beyond which a number counts as unbounded: ROS has no open ranges."""


class ParameterChange(NamedTuple):
    """A parameter of a node that is to be set; `on_refusal` is called with the reason if it is not, in a thread."""

    node: str
    name: str
    value: Any
    on_refusal: Callable[[str], None] = lambda _: None


class WatchedParameters:
    """The parameters of some nodes; a node that answers late delays neither topics nor graph."""

    def __init__(self, node: RmwNode) -> None:
        self._node = node
        self._thread = ThreadPoolExecutor(1, "parameters")
        self._reading: Future[None] | None = None
        self._descriptors: dict[str, dict[str, rcl.ParameterDescriptor]] = {}
        self._views: dict[str, NodeParameters] = {}
        self._outcomes: dict[str, str] = {}
        self._closing = False

    def read(self, owners: list[str]) -> tuple[NodeParameters, ...]:
        """Return the last known parameters of these nodes, and read them again unless that is under way."""
        if self._reading is None or self._reading.done():
            self._reading = self._thread.submit(self._read_all, owners)
        return tuple(self._views[owner] for owner in owners if owner in self._views)

    def set(self, change: ParameterChange) -> None:
        """Set a parameter soon; how it ended is the outcome of the node's view."""
        self._thread.submit(self._set, change)

    def close(self) -> None:
        """End the thread after the call that is under way."""
        self._closing = True
        self._thread.shutdown(cancel_futures=True)

    def _read_all(self, owners: list[str]) -> None:
        for owner in owners:
            if self._closing:
                return
            try:
                self._views[owner] = NodeParameters(
                    owner, self._read(owner), outcome=self._outcomes.get(owner, "")
                )
            except ToolError:
                self._views[owner] = NodeParameters(
                    owner, problem=f"Node {owner} does not answer; it may have ended"
                )

    def _read(self, owner: str) -> tuple[ParameterView, ...]:
        names = parameter_names(self._node, owner)
        known = self._descriptors.setdefault(owner, {})
        if missing := [name for name in names if name not in known]:
            known.update((one.name, one) for one in describe_parameters(self._node, owner, missing))
        values = get_parameters(self._node, owner, names)
        return tuple(
            _view(name, value, known.get(name, rcl.ParameterDescriptor()))
            for name, value in zip(names, values, strict=False)
            if value.type in FIELDS
        )

    def _set(self, change: ParameterChange) -> None:
        owner, name = change.node, change.name
        try:
            value = plain_to_parameter(get_parameter(self._node, owner, name).type, change.value, name)
            result = set_parameter(self._node, owner, name, value)
            refused = (
                "" if result.successful else f"Node {owner} refuses it: {result.reason or 'no reason given'}"
            )
        except ToolError as error:
            refused = str(error)
        if refused:
            change.on_refusal(refused)
        self._outcomes[owner] = refused or f"Parameter {name} is now {to_yaml(value.plain)}"
        self._read_all([owner])


def _view(name: str, value: rcl.ParameterValue, descriptor: rcl.ParameterDescriptor) -> ParameterView:
    bounds: tuple[Any, ...] = (*descriptor.floating_point_range, *descriptor.integer_range)
    view = ParameterView(
        name,
        type_text(value.type),
        msgspec.to_builtins(value.plain),
        descriptor.description,
        descriptor.read_only,
    )
    if not bounds:
        return view
    low, high = bounds[0].from_value, bounds[0].to_value
    return msgspec.structs.replace(
        view,
        low=low if abs(low) < MAX_BOUND else None,
        high=high if abs(high) < MAX_BOUND else None,
        step=bounds[0].step,
    )
