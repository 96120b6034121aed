"""Listening to one topic, whatever its types and QoS are, and telling why nothing comes."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Iterator
from typing import NamedTuple

from chefbot.commands.tools.common import SILENCE, errors, mismatches_of
from chefbot.commands.tools.topic_look import seen
from chefbot.wire.attachment import Attachment
from chefbot.wire.bag.recorder import maybe_buffered
from chefbot.wire.graph import Graph, Named
from chefbot.wire.names import WireType
from chefbot.wire.node import WireNode
from chefbot.wire.offers import ask_for, types_said
from chefbot.wire.subscription import Receive


class Heard(NamedTuple):
    """One sample and when it came, s of the monotonic clock."""

    kind: WireType
    data: bytes
    at: float
    attachment: Attachment


class Ear:
    """Listens to all types of a topic."""

    def __init__(self, node: WireNode, named: Named) -> None:
        self._graph: Graph = node.wire.graph
        self._named = named
        self._queue: queue.SimpleQueue[Heard] = queue.SimpleQueue()
        for kind in types_said(named):
            asked = ask_for(one.end.qos for one in named.givers if one.end.type == kind)
            buffered = not asked.latched and maybe_buffered(kind)
            node.raw_subscription(named.name, kind, self._receiver(kind), asked, buffered=buffered)

    def so_far(self) -> list[Heard]:
        """All that came since the last look."""
        heard = []
        while not self._queue.empty():
            heard.append(self._queue.get())
        return heard

    def samples(self, seconds: float | None, stop: threading.Event) -> Iterator[Heard]:
        """For so long, or until `stop`. After a while of silence the reasons go to the standard error, once."""
        began = time.monotonic()
        until = None if seconds is None else began + seconds
        told = False
        while not stop.is_set() and (until is None or time.monotonic() < until):
            try:
                yield self._queue.get(timeout=0.05)
                told = True
            except queue.Empty:
                if not told and time.monotonic() - began > SILENCE:
                    told = True
                    for sentence in why_silent(self._graph, self._named.name):
                        errors.print(f"chefbot: {sentence}")

    def _receiver(self, kind: WireType) -> Receive:
        def receive(data: bytes, attachment: Attachment) -> None:
            self._queue.put(Heard(kind, data, time.monotonic(), attachment))

        return receive


def why_silent(graph: Graph, name: str) -> list[str]:
    """What the tokens say about a topic on which nothing comes."""
    found = mismatches_of(graph, name)
    named = graph.topics().get(name)
    speakers = [one.node.full_name for one in seen(named.givers)] if named else []
    if not speakers:
        return [f"nobody publishes {name}", *found]
    return [f"{name} is silent, although {', '.join(dict.fromkeys(speakers))} could speak there", *found]
