"""Saying again what a bag has kept."""

from __future__ import annotations

import threading
import time
from collections.abc import Collection
from typing import Any, NamedTuple

from chefbot.errors import UserError, nearest
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.ros2.bag.reader import Bag, BagMessage, BagTopic
from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.names import WireType, resolve
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import CLOCK, DEFAULT, QoS

MATCH_WAIT = 1.0
"""Seconds that those who listen already are waited for."""
LAST_WAIT = 0.2
"""Seconds that the last messages have to get away."""
CLOCK_TOPIC = "/clock"
CLOCK_PERIOD = 0.01
"""Wall seconds between two tellings of the recorded time, as a simulated launch tells its own."""


class Played(NamedTuple):
    """How it went."""

    messages: int
    seconds: float


class Player:
    """Publishers for all of a bag's topics, or for the chosen ones.

    UserError when a chosen topic is not in the bag, or nothing of it can be said on the wire.
    """

    def __init__(
        self, node: WireNode, bag: Bag, topics: Collection[str] | None = None, *, clock: bool = False
    ) -> None:
        """`clock`: tell the recorded time on /clock meanwhile; UserError when the bag holds one that is played."""
        self._bag = bag
        self._chosen = _choose(bag, topics)
        if clock and CLOCK_TOPIC in self._chosen:
            raise UserError(f"{bag.path} has {CLOCK_TOPIC} itself, which is played; leave --clock out")
        self.left_out: list[str] = []
        """A sentence for each topic that cannot be said on the wire."""
        self._publishers: dict[tuple[str, WireType], Publisher[Any]] = {}
        for topic in bag.topics:
            if topic.name in self._chosen:
                self._open(node, topic)
        self._clock = node.publisher(CLOCK_TOPIC, Clock, CLOCK) if clock else None
        self._told_ns = 0
        if not self._publishers:
            raise UserError(
                f"nothing of {bag.path} can be played: " + ("; ".join(self.left_out) or "it is empty")
            )

    def await_listeners(self, node: WireNode) -> None:
        """Until the publishers have found those who listen already, but not for long."""
        listened = {name for name, named in node.wire.graph.topics().items() if named.takers}
        waited = [one for (name, _), one in self._publishers.items() if name in listened]
        until = time.monotonic() + MATCH_WAIT
        while not all(one.heard for one in waited) and time.monotonic() < until:
            time.sleep(0.01)

    def play(self, rate: float, stop: threading.Event) -> Played:
        """Once, `rate` times as fast as it was recorded, until the end or `stop`."""
        began, first_ns, count = time.monotonic(), None, 0
        self._told_ns = 0
        for message in self._bag.messages(self._chosen):
            first_ns = message.heard_ns if first_ns is None else first_ns
            due = began + (message.heard_ns - first_ns) * 1e-9 / rate
            if not self._wait(due, message.heard_ns, rate, stop):
                break
            count += self._say(message)
        stop.wait(LAST_WAIT)
        return Played(count, time.monotonic() - began)

    def _wait(self, due: float, due_ns: int, rate: float, stop: threading.Event) -> bool:
        """Until the monotonic clock says `due`, which was `due_ns` when it was recorded; False if stopped before."""
        while (rest := due - time.monotonic()) > 0.0:
            self._tell_time(due_ns - round(rest * rate * 1e9))
            if stop.wait(min(rest, CLOCK_PERIOD) if self._clock else rest):
                return False
        self._tell_time(due_ns)
        return not stop.is_set()

    def _tell_time(self, now_ns: int) -> None:
        """At most every CLOCK_PERIOD, and never back."""
        if self._clock is not None and now_ns - self._told_ns >= CLOCK_PERIOD * 1e9:
            self._told_ns = now_ns
            self._clock.publish(Clock(Time.of(now_ns)))

    def _say(self, message: BagMessage) -> int:
        publisher = self._publishers.get((message.topic, message.kind))
        if publisher is None:
            return 0
        publisher.publish_cdr(message.data)
        return 1

    def _open(self, node: WireNode, topic: BagTopic) -> None:
        why_not = _why_not(topic)
        if why_not:
            self.left_out.append(f"{topic.name}: {why_not}")
        else:
            made = node.raw_publisher(topic.name, topic.kind, _offer(topic.offers))
            self._publishers[topic.name, topic.kind] = made


def _choose(bag: Bag, topics: Collection[str] | None) -> set[str]:
    there = {topic.name for topic in bag.topics}
    if topics is None:
        return there
    chosen = {name if name.startswith("/") else f"/{name}" for name in topics}
    for name in sorted(chosen - there):
        raise UserError(f"{bag.path} has no topic {name}{nearest(name, there)}")
    return chosen


def _why_not(topic: BagTopic) -> str:
    """Empty when it can be said."""
    if topic.encoding != "cdr":
        return f"its messages are {topic.encoding or 'of no named encoding'}, not CDR"
    if not topic.kind.hash:
        return f"the hash of type {topic.kind.name or '(none)'} is neither in the bag nor known here"
    try:
        resolve(topic.name)
        _ = topic.kind.dds
    except WireError as error:
        return str(error)
    return ""


def _offer(offers: tuple[QoS, ...]) -> QoS:
    """What its publishers offered, if all the same; room for the last of each of them."""
    if not offers or len({(one.reliability, one.durability) for one in offers}) > 1:
        return DEFAULT
    return offers[0]._replace(depth=sum(one.depth for one in offers))
