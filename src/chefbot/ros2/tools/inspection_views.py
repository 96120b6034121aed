"""What an inspector shows of the ROS graph: its nodes and topics, and the newest messages of watched topics."""

from __future__ import annotations

from typing import Any

import msgspec


class TopicSummary(msgspec.Struct, frozen=True):
    """A topic with its types and the nodes at both ends."""

    name: str
    types: tuple[str, ...]
    publishers: tuple[str, ...]
    subscriptions: tuple[str, ...]


class GraphSummary(msgspec.Struct, frozen=True):
    """The graph without tools and hidden names; `problem` is a sentence if there is none."""

    nodes: tuple[str, ...] = ()
    topics: tuple[TopicSummary, ...] = ()
    mismatches: tuple[str, ...] = ()
    problem: str = ""


class TopicValue(msgspec.Struct, frozen=True):
    """The newest message of a watched topic as plain data, and the topic's rate over the last seconds."""

    name: str
    hz: float = 0.0
    bytes_per_second: float = 0.0
    messages: int = 0
    """Number of messages since the topic is watched."""
    time: float = 0.0
    """When the newest message arrived, s of a clock that begins with the inspection."""
    value: Any = None
    problem: str = ""
    """Why there is no value, as a sentence."""
