"""Listening to one topic, whatever its types and QoS are, and telling why nothing comes."""

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
"""Samples that wait for a slow terminal; what comes beyond is counted and not shown."""
Hear = Callable[[WireType, bytes], None]


class Heard(NamedTuple):
    """One sample."""

    kind: WireType
    data: bytes


def listen(node: WireNode, named: Named, hear: Hear) -> None:
    """Call `hear(type, bytes)` in Zenoh's thread for all that is said on a topic."""
    for kind in types_said(named):
        asked = ask_for(one.end.qos for one in named.givers if one.end.type == kind)
        buffered = not asked.latched and maybe_buffered(kind)
        node.raw_subscription(named.name, kind, _of_type(kind, hear), asked, buffered=buffered)


class Ear:
    """Samples of a topic, one after the other, in the caller's thread."""

    def __init__(self, node: WireNode, named: Named) -> None:
        self.missed = 0
        """Samples that came faster than they were taken."""
        self._graph: Graph = node.wire.graph
        self._name = named.name
        self._queue: queue.Queue[Heard] = queue.Queue(MOST_WAITING)
        listen(node, named, self._keep)

    def samples(self, seconds: float | None, stop: threading.Event) -> Iterator[Heard]:
        """For so long, or until `stop`. After a while of silence the reasons go to the standard error, once."""
        watch = SilenceWatch(self._graph, self._name)
        until = None if seconds is None else time.monotonic() + seconds
        while not stop.is_set() and (until is None or time.monotonic() < until):
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
    """Tells once why a topic is silent, when it has been for a while."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.heard = False
        self._graph, self._name = graph, name
        self._since = time.monotonic()

    def look(self, *, last: bool = False) -> None:
        """Now and then; `last`: nobody waits any longer."""
        if not self.heard and (last or time.monotonic() - self._since > SILENCE):
            self.heard = True
            for sentence in why_silent(self._graph, self._name):
                errors.print(f"chefbot: {sentence}")


def _of_type(kind: WireType, hear: Hear) -> Receive:
    def receive(data: bytes, _: Attachment) -> None:
        hear(kind, data)

    return receive


def why_silent(graph: Graph, name: str) -> list[str]:
    """What the tokens say about a topic on which nothing comes."""
    found = mismatches(graph, name)
    named = graph.topics().get(name)
    speakers = [one.node.full_name for one in seen(named.givers)] if named else []
    if not speakers:
        return [f"nobody publishes {name}", *found]
    return [f"{name} is silent, although {', '.join(dict.fromkeys(speakers))} could speak there", *found]
