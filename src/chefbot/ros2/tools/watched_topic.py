"""A topic of the graph that is watched: its newest message as plain data, and its rates."""

from __future__ import annotations

import math
import time
from collections import deque
from typing import Any

import msgspec

from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.yaml_conversion import message_to_dict
from chefbot.ros2.rmw.graph import EndpointGroup
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.subscription import Subscription
from chefbot.ros2.tools.common import ToolError
from chefbot.ros2.tools.inspection_views import TopicValue
from chefbot.ros2.tools.remote_types import definition_of
from chefbot.ros2.tools.subscribe import subscribe_any

WINDOW = 5.0
"""Time over which rates are measured, s."""
MIN_SPAN = 0.2
"""Minimum time over which rates are measured after the begin, s."""
SHOWN_ELEMENTS, SHOWN_BYTES = 12, 6000
"""Maximum number of shown elements of an array, and maximum size of a value as JSON."""
NO_PUBLISHER = "No node publishes it now"


class WatchedTopic:
    """Keeps the newest sample of a topic; it is decoded only when it is shown."""

    def __init__(self, node: RmwNode, name: str, begin: float) -> None:
        self._node, self._name, self._begin = node, name, begin
        self._since = time.monotonic()
        self._newest: tuple[float, InterfaceType, bytes] | None = None
        self._arrivals: deque[tuple[float, int]] = deque()
        self._count = 0
        self._types: dict[InterfaceType, type[Message] | str] = {}
        self._subscriptions: list[Subscription] = []

    def value(self, topic: EndpointGroup | None) -> TopicValue:
        """Return the newest message with the rate; `topic` is what the graph has of it, None for nothing."""
        is_published = topic is not None and bool(topic.providers)
        if topic is not None and is_published and not self._subscriptions:
            self._subscriptions = subscribe_any(self._node, topic, self._receive)
        hz, rate = self._rates()
        base = TopicValue(self._name, round(hz, 1), round(rate), self._count)
        newest = self._newest
        if not is_published:
            base = msgspec.structs.replace(base, problem=NO_PUBLISHER)
        if newest is None:
            return base
        at, kind, data = newest
        return self._decoded(msgspec.structs.replace(base, time=round(at - self._begin, 3)), kind, data)

    def close(self) -> None:
        """End the subscriptions of this topic."""
        for subscription in self._subscriptions:
            self._node.destroy(subscription)

    def _receive(self, kind: InterfaceType, data: bytes) -> None:
        """Keep a sample, in a thread of Zenoh; deques are safe from several threads."""
        now = time.monotonic()
        self._newest = (now, kind, data)
        self._arrivals.append((now, len(data)))
        self._count += 1

    def _rates(self) -> tuple[float, float]:
        """Return messages and bytes per second over the last seconds."""
        now = time.monotonic()
        while self._arrivals and self._arrivals[0][0] < now - WINDOW:
            self._arrivals.popleft()
        arrivals, span = list(self._arrivals), min(WINDOW, max(now - self._since, MIN_SPAN))
        return len(arrivals) / span, sum(size for _, size in arrivals) / span

    def _decoded(self, view: TopicValue, kind: InterfaceType, data: bytes) -> TopicValue:
        known = self._definition(kind)
        if isinstance(known, str):
            return msgspec.structs.replace(view, problem=known)
        try:
            plain = _finite(message_to_dict(known.from_cdr(data), SHOWN_ELEMENTS))
        except CdrError as error:
            return msgspec.structs.replace(view, problem=f"It is not a valid {kind.name}: {error}")
        if len(msgspec.json.encode(plain)) > SHOWN_BYTES:
            return msgspec.structs.replace(view, problem="It is too long to be shown")
        return msgspec.structs.replace(view, value=plain)

    def _definition(self, kind: InterfaceType) -> type[Message] | str:
        """Return the class of a type, or why there is none; a type of a node's own is requested only once."""
        if kind not in self._types:
            try:
                self._types[kind] = definition_of(self._node, kind, f"topic {self._name}")
            except ToolError as error:
                self._types[kind] = str(error)
        return self._types[kind]


def _finite(value: Any) -> Any:
    """Return plain data in which numbers that JSON does not have are texts: nan, inf, -inf."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_finite(part) for part in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
