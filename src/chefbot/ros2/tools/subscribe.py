"""Subscribing to a topic with any types and QoS, and the reasons why no message arrives."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.graph import EndpointGroup, Graph
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import VOLATILE
from chefbot.ros2.rmw.qos_matching import best_matching_qos, offered_types
from chefbot.ros2.rmw.subscription import SampleCallback, Subscription
from chefbot.ros2.tools.common import NO_MESSAGE_TIMEOUT, errors, mismatches
from chefbot.ros2.tools.topic_info import without_tools

MAX_QUEUED = 1000
"""Maximum number of samples queued for a slow terminal; further samples are counted but not shown."""
TypedSampleCallback = Callable[[InterfaceType, bytes], None]


class ReceivedSample(NamedTuple):
    """A received sample: its type and CDR bytes."""

    kind: InterfaceType
    data: bytes


def subscribe_any(
    node: RmwNode, topic: EndpointGroup, callback: TypedSampleCallback, *, stored: bool = True
) -> list[Subscription]:
    """Subscribe to all types of a topic and call `callback(type, bytes)` in a Zenoh thread.

    stored: whether to receive messages from before the subscription, too, which latched topics keep.
    """
    subscriptions = []
    for kind in offered_types(topic):
        qos = best_matching_qos(
            publisher.info.qos for publisher in topic.providers if publisher.info.type == kind
        )
        if not stored:
            qos = qos._replace(durability=VOLATILE)
        subscriptions.append(node.raw_subscription(topic.name, kind, _of_type(kind, callback), qos))
    return subscriptions


class SampleStream:
    """An iterator over the samples of a topic, in the caller's thread."""

    def __init__(self, node: RmwNode, named: EndpointGroup) -> None:
        self.missed = 0
        """Samples dropped because they arrived faster than they were processed."""
        self._graph: Graph = node.wire.graph
        self._name = named.name
        self._queue: queue.Queue[ReceivedSample] = queue.Queue(MAX_QUEUED)
        subscribe_any(node, named, self._keep)

    def samples(self, seconds: float | None, stop: threading.Event) -> Iterator[ReceivedSample]:
        """Yield samples for `seconds`, or until `stop` is set.

        If none arrive for a while, the reasons are printed once to the standard error.
        """
        watch = NoMessageMonitor(self._graph, self._name)
        deadline = None if seconds is None else time.monotonic() + seconds
        while not stop.is_set() and (deadline is None or time.monotonic() < deadline):
            try:
                yield self._queue.get(timeout=0.05)
                watch.received = True
            except queue.Empty:
                watch.look()

    def _keep(self, kind: InterfaceType, data: bytes) -> None:
        try:
            self._queue.put_nowait(ReceivedSample(kind, data))
        except queue.Full:
            self.missed += 1


class NoMessageMonitor:
    """Prints once why a topic has no messages, after a while of silence."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.received = False
        self._graph, self._name = graph, name
        self._since = time.monotonic()

    def look(self, *, last: bool = False) -> None:
        """Check for silence; call periodically.

        With `last` the reasons are printed without further waiting.
        """
        if not self.received and (last or time.monotonic() - self._since > NO_MESSAGE_TIMEOUT):
            self.received = True
            for sentence in no_message_reasons(self._graph, self._name):
                errors.print(f"chefbot: {sentence}")


def _of_type(kind: InterfaceType, callback: TypedSampleCallback) -> SampleCallback:
    def receive(data: bytes, _: Attachment) -> None:
        callback(kind, data)

    return receive


def no_message_reasons(graph: Graph, name: str) -> list[str]:
    """Return possible reasons from the graph why a topic has no messages."""
    sentences = mismatches(graph, name)
    named = graph.topics().get(name)
    publishers = [endpoint.node.full_name for endpoint in without_tools(named.providers)] if named else []
    if not publishers:
        return [f"there is no publisher of {name}", *sentences]
    return [
        f"{name} has no messages, although {', '.join(dict.fromkeys(publishers))} publish it",
        *sentences,
    ]
