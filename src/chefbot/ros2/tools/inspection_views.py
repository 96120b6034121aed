"""What an inspector shows of the ROS graph: nodes, topics and their newest messages, parameters and the log."""

from __future__ import annotations

from typing import Any

import msgspec


class TopicSummary(msgspec.Struct, frozen=True):
    """A topic with its types, the nodes at both ends, and its rate; None before it is measured, 0 for a rare one."""

    name: str
    types: tuple[str, ...]
    publishers: tuple[str, ...]
    subscriptions: tuple[str, ...]
    hz: float | None = None


class GraphSummary(msgspec.Struct, frozen=True):
    """The graph without tools and hidden names; `problem` is a sentence if there is none."""

    nodes: tuple[str, ...] = ()
    topics: tuple[TopicSummary, ...] = ()
    mismatches: tuple[str, ...] = ()
    problem: str = ""
    parameter_nodes: tuple[str, ...] = ()
    """The nodes whose parameters can be read."""


class TopicValue(msgspec.Struct, frozen=True):
    """The newest message of a watched topic as plain data, and the topic's rate over the last seconds."""

    name: str
    hz: float = 0.0
    bytes_per_second: float = 0.0
    messages: int = 0
    """Number of messages since the topic is watched."""
    time: float = 0.0
    """When the newest message arrived, s of a clock that runs as long as the inspector."""
    value: Any = None
    problem: str = ""
    """Why there is no value, as a sentence."""


class ParameterView(msgspec.Struct, frozen=True):
    """A parameter of a node; a bound is None if there is none, and 0 is no step."""

    name: str
    type: str
    value: Any
    description: str = ""
    read_only: bool = False
    low: float | None = None
    high: float | None = None
    step: float = 0.0


class NodeParameters(msgspec.Struct, frozen=True):
    """The parameters of a node, how the last change of one ended, and why there are none, as sentences."""

    node: str
    parameters: tuple[ParameterView, ...] = ()
    outcome: str = ""
    problem: str = ""


class LogLine(msgspec.Struct, frozen=True):
    """A message of the log: time on the robot's clock (s), level as in rcl_interfaces/Log, node and text."""

    time: float
    level: int
    node: str
    text: str
