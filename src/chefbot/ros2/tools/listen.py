"""Subscribing to a topic with any types and QoS, and the reasons why no message arrives."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

from chefbot.ros2.bag.recorder import maybe_buffered
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.graph import Graph, Named
from chefbot.ros2.rmw.names import WireType
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos_matching import ask_for, types_said
from chefbot.ros2.rmw.subscription import Receive
from chefbot.ros2.tools.common import SILENCE, errors, mismatches
from chefbot.ros2.tools.topic_info import seen

MOST_WAITING = 1000
"""Maximum number of samples queued for a slow terminal; further samples are counted but not shown."""
Hear = Callable[[WireType, bytes], None]


class Heard(NamedTuple):
    """A received sample: its type and CDR bytes."""

    kind: WireType
    data: bytes


def listen(node: WireNode, topic: Named, callback: Hear) -> None:
    """Subscribe to all types of a topic and call `hear(type, bytes)` in a Zenoh thread."""
    for kind in types_said(topic):
        qos = ask_for(publisher.end.qos for publisher in topic.givers if publisher.end.type == kind)
        buffered = not qos.latched and maybe_buffered(kind)
        node.raw_subscription(topic.name, kind, _of_type(kind, callback), qos, buffered=buffered)


class Ear:
    """An iterator over the samples of a topic, in the caller's thread."""

    def __init__(self, node: WireNode, named: Named) -> None:
        self.missed = 0
        """Samples dropped because they arrived faster than they were processed."""
        self._graph: Graph = node.wire.graph
        self._name = named.name
        self._queue: queue.Queue[Heard] = queue.Queue(MOST_WAITING)
        listen(node, named, self._keep)

    def samples(self, seconds: float | None, stop: threading.Event) -> Iterator[Heard]:
        """Yield samples for `seconds`, or until `stop` is set.

        If none arrive for a while, the reasons are printed once to the standard error.
        """
        watch = SilenceWatch(self._graph, self._name)
        deadline = None if seconds is None else time.monotonic() + seconds
        while not stop.is_set() and (deadline is None or time.monotonic() < deadline):
            try:
                yield self._queue.get(timeout=0.05)
                watch.heard = True
            except queue.Empty:
                watch.look()

    def _keep(self, kind: WireType, data: bytes) -> None:
        try:
            self._queue.put_nowait(Heard(kind, data))
        except queue.Full:
            self.missed += 1


class SilenceWatch:
    """Prints once why a topic has no messages, after a while of silence."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.heard = False
        self._graph, self._name = graph, name
        self._since = time.monotonic()

    def look(self, *, last: bool = False) -> None:
        """Check for silence; call periodically.

        With `last` the reasons are printed without further waiting.
        """
        if not self.heard and (last or time.monotonic() - self._since > SILENCE):
            self.heard = True
            for sentence in why_silent(self._graph, self._name):
                errors.print(f"chefbot: {sentence}")


def _of_type(kind: WireType, callback: Hear) -> Receive:
    def receive(data: bytes, _: Attachment) -> None:
        callback(kind, data)

    return receive


def why_silent(graph: Graph, name: str) -> list[str]:
    """Return possible reasons from the graph why a topic has no messages."""
    sentences = mismatches(graph, name)
    named = graph.topics().get(name)
    publishers = [endpoint.node.full_name for endpoint in seen(named.givers)] if named else []
    if not publishers:
        return [f"nobody publishes {name}", *sentences]
    return [
        f"{name} is silent, although {', '.join(dict.fromkeys(publishers))} could speak there",
        *sentences,
    ]
