"""The loop: one a process; it delivers everything in one order that depends on nothing but the events.

The key of an event is (time, rank, sequence): at one instant first what devices measured, then messages
until none is left, then timers. With it a run, the same run again and the replay of its log are the same to
the byte.

An exception ends the run unless `faults` takes it; see `chefbot.runtime.callback_faults`.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Container
from dataclasses import dataclass, field
from functools import partial
from threading import Condition
from typing import Protocol, TypeVar

from chefbot.msgs.idl.message import Message
from chefbot.runtime.clock import Clock, wall_ns

DEVICE, MESSAGE, TIMER = range(3)
T = TypeVar("T")

Handler = Callable[[Message], None]
Tap = Callable[["Publication"], None]


@dataclass(frozen=True, slots=True)
class Publication:
    """A message on its way: where, by whom, when."""

    topic: str
    message: Message
    publisher: str
    from_device: bool
    time_ns: int
    latched: bool


@dataclass(slots=True)
class Timing:
    """A callback of a node: whose it is, its name for people, and the wall time that it has cost so far."""

    owner: str = ""
    """Name of the node; empty for what belongs to none, such as a launch that starts."""
    name: str = ""
    from_device: bool = False
    """Whether a device runs it of its own accord, and not because of a message."""
    calls: int = 0
    total_ns: int = 0
    worst_ns: int = 0


class FaultHandler(Protocol):
    """What becomes of exceptions that nodes' callbacks raise."""

    def take(self, callback: Timing, error: Exception) -> None:
        """Count it; raise it again if it has to end the run."""

    def is_silenced(self, node: str) -> bool:
        """Whether the node fails so often that it must not drive."""


@dataclass(slots=True)
class Subscription:
    """One handler on one topic."""

    topic: str
    owner: str
    handler: Handler
    timing: Timing = field(default_factory=Timing)
    active: bool = True


class Scheduled:
    """An event to come; `cancel()` makes it never happen."""

    __slots__ = ("action", "due_ns", "timing")

    def __init__(self, action: Callable[[], None], timing: Timing, due_ns: int) -> None:
        self.action: Callable[[], None] | None = action
        self.timing = timing
        self.due_ns = due_ns

    def cancel(self) -> None:
        """It will not happen."""
        self.action = None


class Loop:
    """Topics, timers and time. Everything but `post` belongs to the thread that calls `run`."""

    def __init__(self, clock: Clock, start_ns: int = 0) -> None:
        self.now_ns = start_ns
        self.timings: dict[str, Timing] = {}
        self.faults: FaultHandler | None = None
        """Takes the exceptions of nodes' callbacks. None: the first one ends the run, as in a test."""
        self.step_began_ns = 0
        """When the event in hand began, monotonic; 0 between two. For those who watch from another thread."""
        self._clock = clock
        self._events: list[tuple[int, int, int, Scheduled]] = []
        self._sequence = 0
        self._topics: dict[str, list[Subscription]] = {}
        self._latched: dict[str, Publication] = {}
        self._taps: list[Tap] = []
        self._outside: deque[tuple[Callable[[], None], Timing | None]] = deque()
        self._running = Timing()
        self._wake = Condition()
        self._stopped = False

    # -- topics

    def subscribe(self, topic: str, owner: str, handler: Handler) -> Subscription:
        """Call `handler` with each message on `topic`; a latched one that is there already comes first."""
        timing = self.timing(owner, f"{owner} <- {topic}")
        subscription = Subscription(topic, owner, handler, timing)
        self._topics.setdefault(topic, []).append(subscription)
        if topic in self._latched:
            message = self._latched[topic].message
            self._deliver_later(subscription, message)
        return subscription

    def unsubscribe(self, subscription: Subscription) -> None:
        """No message reaches it any more, those under way included."""
        subscription.active = False
        self._topics[subscription.topic].remove(subscription)

    def publish(
        self,
        topic: str,
        message: Message,
        publisher: str,
        *,
        from_device: bool = False,
        latched: bool = False,
    ) -> None:
        """Deliver to all who listen now, behind what is already under way at this instant."""
        publication = Publication(topic, message, publisher, from_device, self.now_ns, latched)
        if latched:
            self._latched[topic] = publication
        for tap in self._taps:
            tap(publication)
        for subscription in self._topics.get(topic, ()):
            self._deliver_later(subscription, message)

    def forget_latched(self, publishers: Container[str]) -> None:
        """As after a restart: old messages are gone, except those of `publishers`."""
        self._latched = {t: p for t, p in self._latched.items() if p.publisher in publishers}

    def latched(self) -> list[Publication]:
        """What late listeners are told."""
        return list(self._latched.values())

    def tap(self, tap: Tap) -> None:
        """See every publication, for recording and checking."""
        self._taps.append(tap)

    def topics(self) -> dict[str, list[str]]:
        """Topic to the names of those who listen."""
        return {
            topic: [one.owner for one in listeners] for topic, listeners in self._topics.items() if listeners
        }

    # -- time

    def at(
        self, time_ns: int, rank: int, action: Callable[[], None], timing: Timing | None = None
    ) -> Scheduled:
        """Do `action` at `time_ns`, in its rank's turn."""
        event = Scheduled(action, timing or Timing(), max(time_ns, self.now_ns))
        self._sequence += 1
        heapq.heappush(self._events, (event.due_ns, rank, self._sequence, event))
        return event

    def timing(self, owner: str, name: str, *, from_device: bool = False) -> Timing:
        """That of the callback `name` of the node `owner`, the same for equal names."""
        return self.timings.setdefault(name, Timing(owner, name, from_device))

    def guarded(self, action: Callable[[T], None]) -> Callable[[T], None]:
        """`action` as a part of the callback in hand: what it raises later counts as this callback's fault."""
        timing = self._running
        return lambda value: self._perform(timing, partial(action, value))

    def post(self, action: Callable[[], None], timing: Timing | None = None) -> None:
        """From any thread: do `action` in the loop as a device's event, as soon as may be."""
        with self._wake:
            self._outside.append((action, timing))
            self._wake.notify()

    def wake(self) -> None:
        """From any thread: the clock may have moved on."""
        with self._wake:
            self._wake.notify()

    def stop(self) -> None:
        """From any thread: `run` returns after the event in hand."""
        with self._wake:
            self._stopped = True
            self._wake.notify()

    def run(self, until_ns: int | None = None, until: Callable[[], bool] | None = None) -> None:
        """Do events in order up to `until_ns` (inclusive), `until()`, `stop()`, or until nothing is left."""
        self._stopped = False
        self._clock.start(self.now_ns)
        while not self._stopped and (until is None or not until()):
            self._take_outside()
            if not self._events:
                break
            due = self._events[0][0]
            if until_ns is not None and due > until_ns:
                self.now_ns = max(self.now_ns, until_ns)
                break
            with self._wake:
                ready = bool(not self._outside and self._clock.wait_until(due, self._wake))
            if ready and not self._outside:
                self._do_next()

    def _take_outside(self) -> None:
        """What came from outside gets a time of its own, so that a replay can put it in the same place."""
        while self._outside:
            action, timing = self._outside.popleft()
            self.at(self._clock.read(self.now_ns) + 1, DEVICE, action, timing)

    def _do_next(self) -> None:
        self.now_ns, _, _, event = heapq.heappop(self._events)
        if event.action is None:
            return
        self.step_began_ns = began = wall_ns()
        timing = self._running = event.timing
        self._perform(timing, event.action)
        took = wall_ns() - began
        self.step_began_ns = 0
        timing.calls += 1
        timing.total_ns += took
        timing.worst_ns = max(timing.worst_ns, took)

    def _perform(self, timing: Timing, action: Callable[[], None]) -> None:
        try:
            action()
        except Exception as error:
            if self.faults is None or not timing.owner:
                raise
            self.faults.take(timing, error)

    def _deliver_later(self, subscription: Subscription, message: Message) -> None:
        def deliver() -> None:
            if subscription.active:
                subscription.handler(message)

        self.at(self.now_ns, MESSAGE, deliver, subscription.timing)
