"""Playback of a bag: its messages are published again."""

from __future__ import annotations

import threading
import time
from collections.abc import Collection
from typing import Any, NamedTuple

from chefbot.errors import name_hint
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.ros2.bag.errors import BagError
from chefbot.ros2.bag.reader import Bag, BagMessage, BagTopic
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.names import InterfaceType, resolve
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.qos import CLOCK, DEFAULT, QoS

MATCH_WAIT = 1.0
"""Maximum time to wait for existing subscribers to match, s."""
FLUSH_TIME = 0.2
"""Time for the last messages to be sent, s."""
CLOCK_TOPIC = "/clock"
CLOCK_PERIOD = 0.01
"""Wall-clock seconds between two /clock messages, as in a simulated launch."""


class PlaybackResult(NamedTuple):
    """The result of playing a bag: number of messages and duration in seconds."""

    messages: int
    seconds: float


class Player:
    """A player with publishers for all topics of a bag, or for the chosen ones.

    Raises BagError when a chosen topic is not in the bag, or when none of them can be published.
    """

    def __init__(
        self, node: RmwNode, bag: Bag, topics: Collection[str] | None = None, *, clock: bool = False
    ) -> None:
        """Create the publishers of the topics to play.

        With `clock` the recorded time is published on /clock; raises BagError when the bag has a /clock that
        is played.
        """
        self._bag = bag
        self._chosen = _choose(bag, topics)
        if clock and CLOCK_TOPIC in self._chosen:
            raise BagError(f"{bag.path} has {CLOCK_TOPIC} itself, which is played; leave --clock out")
        self.skipped_topics: list[str] = []
        """A sentence for each topic that cannot be published."""
        self._publishers: dict[tuple[str, InterfaceType], Publisher[Any]] = {}
        for topic in bag.topics:
            if topic.name in self._chosen:
                self._create_publisher(node, topic)
        self._clock = node.publisher(CLOCK_TOPIC, Clock, CLOCK) if clock else None
        self._clock_ns = 0
        if not self._publishers:
            raise BagError(
                f"nothing of {bag.path} can be played: " + ("; ".join(self.skipped_topics) or "it is empty")
            )

    def wait_for_subscribers(self, node: RmwNode) -> None:
        """Wait up to MATCH_WAIT until the publishers have matched the existing subscribers."""
        subscribed = {name for name, endpoints in node.wire.graph.topics().items() if endpoints.consumers}
        publishers = [publisher for (name, _), publisher in self._publishers.items() if name in subscribed]
        deadline = time.monotonic() + MATCH_WAIT
        while not all(publisher.has_subscribers for publisher in publishers) and time.monotonic() < deadline:
            time.sleep(0.01)

    def play(self, rate: float, stop: threading.Event) -> PlaybackResult:
        """Play the bag once, `rate` times as fast as it was recorded, until the end or `stop`."""
        start, first_ns, count = time.monotonic(), None, 0
        self._clock_ns = 0
        for message in self._bag.messages(self._chosen):
            first_ns = message.log_time_ns if first_ns is None else first_ns
            # Time of the message on the monotonic clock, scaled by the playback rate
            due = start + (message.log_time_ns - first_ns) * 1e-9 / rate
            if not self._wait(due, message.log_time_ns, rate, stop):
                break
            count += self._publish(message)
        stop.wait(FLUSH_TIME)
        return PlaybackResult(count, time.monotonic() - start)

    def _wait(self, due: float, due_ns: int, rate: float, stop: threading.Event) -> bool:
        """Wait until the monotonic clock reaches `due`, publishing /clock meanwhile.

        `due_ns` is the same instant in recorded time. Returns False if `stop` was set before.
        """
        while (remaining := due - time.monotonic()) > 0.0:
            self._publish_clock(due_ns - round(remaining * rate * 1e9))
            if stop.wait(min(remaining, CLOCK_PERIOD) if self._clock else remaining):
                return False
        self._publish_clock(due_ns)
        return not stop.is_set()

    def _publish_clock(self, now_ns: int) -> None:
        """Publish the recorded time, at most every CLOCK_PERIOD and never backward."""
        if self._clock is not None and now_ns - self._clock_ns >= CLOCK_PERIOD * 1e9:
            self._clock_ns = now_ns
            self._clock.publish(Clock(Time.of(now_ns)))

    def _publish(self, message: BagMessage) -> int:
        publisher = self._publishers.get((message.topic, message.kind))
        if publisher is None:
            return 0
        publisher.publish_cdr(message.data)
        return 1

    def _create_publisher(self, node: RmwNode, topic: BagTopic) -> None:
        problem = _unplayable_reason(topic)
        if problem:
            self.skipped_topics.append(f"{topic.name}: {problem}")
        else:
            publisher = node.raw_publisher(topic.name, topic.kind, _playback_qos(topic.offered_qos))
            self._publishers[topic.name, topic.kind] = publisher


def _choose(bag: Bag, topics: Collection[str] | None) -> set[str]:
    available = {topic.name for topic in bag.topics}
    if topics is None:
        return available
    chosen = {name if name.startswith("/") else f"/{name}" for name in topics}
    for name in sorted(chosen - available):
        raise BagError(f"{bag.path} has no topic {name}{name_hint(name, available)}")
    return chosen


def _unplayable_reason(topic: BagTopic) -> str:
    """Return why a topic cannot be published; empty when it can."""
    if topic.encoding != "cdr":
        return f"its messages are {topic.encoding or 'of no named encoding'}, not CDR"
    if not topic.kind.hash:
        return f"the hash of type {topic.kind.name or '(none)'} is neither in the bag nor known here"
    try:
        resolve(topic.name)
        _ = topic.kind.dds
    except RmwError as error:
        return str(error)
    return ""


def _playback_qos(offers: tuple[QoS, ...]) -> QoS:
    """Return the QoS that its publishers offered if they agree, with room for the last messages of each."""
    if not offers or len({(offer.reliability, offer.durability) for offer in offers}) > 1:
        return DEFAULT
    return offers[0]._replace(depth=sum(offer.depth for offer in offers))
