"""Rates of all topics of the graph, each measured for a moment, so that a large topic costs a few messages."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Mapping

from chefbot.ros2.rmw.graph import EndpointGroup
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.tools.meter import Meter
from chefbot.ros2.tools.subscribe import subscribe_any

AT_ONCE = 3
"""Number of topics that are measured at the same time."""
MAX_MESSAGES, MAX_TIME = 10, 3.0
"""Number of messages after which a topic is measured, and the time after which it is, s."""


class SampledRates:
    """Measures a few topics at a time, one after the other and again from the beginning.

    rates: messages per second by topic, 0 for fewer than two messages in MAX_TIME; topics that were not measured yet
    are missing.
    """

    def __init__(self, node: RmwNode) -> None:
        self.rates: dict[str, float] = {}
        self._node = node
        self._waiting: deque[str] = deque()
        self._samples: dict[str, TopicSample] = {}

    def update(self, topics: Mapping[str, EndpointGroup]) -> None:
        """Take the rates of topics whose measurement is complete, and begin to measure others of these topics."""
        for name, sample in list(self._samples.items()):
            if sample.is_complete:
                self.rates[name] = sample.rate
                self._end(name)
        if not self._waiting:
            self._waiting.extend(topics)
        while self._waiting and len(self._samples) < AT_ONCE:
            name = self._waiting.popleft()
            if name in topics and name not in self._samples:
                self._samples[name] = TopicSample(self._node, topics[name])

    def close(self) -> None:
        """End the subscriptions of all topics that are measured."""
        for name in list(self._samples):
            self._end(name)

    def _end(self, name: str) -> None:
        self._samples.pop(name).close()


class TopicSample:
    """The rate of the next messages of a topic."""

    def __init__(self, node: RmwNode, topic: EndpointGroup) -> None:
        self._node = node
        self._begin = time.monotonic()
        self._meter = Meter()
        self._subscriptions = subscribe_any(node, topic, self._note_arrival, stored=False)

    @property
    def is_complete(self) -> bool:
        """Whether enough messages have arrived, or enough time has passed."""
        enough = self._meter.rate().messages >= MAX_MESSAGES
        return enough or time.monotonic() - self._begin >= MAX_TIME

    @property
    def rate(self) -> float:
        """Mean rate, Hz; 0 with fewer than two messages."""
        return self._meter.rate().hz

    def close(self) -> None:
        """End the subscriptions of this topic."""
        for subscription in self._subscriptions:
            self._node.destroy(subscription)

    def _note_arrival(self, _kind: InterfaceType, data: bytes) -> None:
        """Note a message, in a thread of Zenoh."""
        self._meter.add(time.monotonic(), len(data))
