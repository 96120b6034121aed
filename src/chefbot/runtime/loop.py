"""The event loop: one per process; it runs all callbacks in a deterministic order.

Events are sorted by (time, rank, sequence): at one instant first device measurements, then messages until
none is left, then timers. So two runs with the same events, and the replay of a log, are bit-identical.

An exception ends the run unless `faults` handles it; see `chefbot.runtime.callback_faults`.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Container
from dataclasses import dataclass, field
from functools import partial
from threading import Condition
from typing import Protocol, TypeVar

import msgspec

from chefbot.msgs.idl.message import Message
from chefbot.runtime.clock import LoopClock, wall_ns

DEVICE, MESSAGE, TIMER = range(3)
T = TypeVar("T")

Handler = Callable[[Message], None]
PublicationObserver = Callable[["Publication"], None]


class Publication(msgspec.Struct, frozen=True):
    """A published message with its topic, publisher and time."""

    topic: str
    message: Message
    publisher: str
    from_device: bool
    time_ns: int
    latched: bool


@dataclass(slots=True)
class CallbackStatistics:
    """Execution-time statistics of one callback: its node, its name and the wall time it has used so far."""

    owner: str = ""
    """Name of the node; empty for a callback that belongs to no node, such as the start of a launch."""
    name: str = ""
    from_device: bool = False
    """Whether a device triggers the callback itself, rather than a message."""
    calls: int = 0
    total_ns: int = 0
    worst_ns: int = 0


class FaultHandler(Protocol):
    """Handles the exceptions that callbacks of nodes raise."""

    def handle(self, callback: CallbackStatistics, error: Exception) -> None:
        """Count the exception; raise it again if it has to end the run."""

    def is_silenced(self, node: str) -> bool:
        """Return whether the node fails so often that its motion commands are dropped."""


class CallbackInterceptor(Protocol):
    """Decides, for fault injection, whether and when callbacks run and messages arrive."""

    def intercept(self, event: ScheduledEvent, rank: int) -> bool:
        """Return whether the due event does not run now: it is dropped, or given to `Loop.reschedule` later."""

    def delivery_ns(self, publication: Publication, subscriber: str) -> int | None:
        """Return when a publication reaches the node `subscriber`; None if it is lost."""

    def silences(self, publisher: str) -> bool:
        """Return whether the node publishes nothing, because its process is dead."""

    def restarted(self, node: str) -> None:
        """Take note that the node has been created again."""


@dataclass(slots=True)
class LoopSubscription:
    """The subscription of one handler to one topic."""

    topic: str
    handler: Handler
    timing: CallbackStatistics = field(default_factory=CallbackStatistics)
    active: bool = True


class ScheduledEvent:
    """A scheduled event that `cancel()` keeps from running."""

    __slots__ = ("action", "due_ns", "timing")

    def __init__(self, action: Callable[[], None], timing: CallbackStatistics, due_ns: int) -> None:
        self.action: Callable[[], None] | None = action
        self.timing = timing
        self.due_ns = due_ns

    def cancel(self) -> None:
        """Cancel the event: its action will not run."""
        self.action = None


class Loop:
    """The event loop with topics, timers and time.

    All methods but `post`, `wake` and `stop` must be called from the thread that calls `run`.
    """

    def __init__(self, clock: LoopClock, start_ns: int = 0) -> None:
        self.now_ns = start_ns
        self.timings: dict[str, CallbackStatistics] = {}
        self.faults: FaultHandler | None = None
        """Handles exceptions of nodes' callbacks. None: the first exception ends the run, as in a test."""
        self.interceptor: CallbackInterceptor | None = None
        """Injects faults of nodes and links. None: every callback runs when it is due."""
        self.callback_start_ns = 0
        """Monotonic start time of the running callback, ns; 0 if none runs. Read by watchdog threads."""
        self._clock = clock
        self._events: list[tuple[int, int, int, ScheduledEvent]] = []
        self._sequence = 0
        self._topics: dict[str, list[LoopSubscription]] = {}
        self._latched: dict[str, Publication] = {}
        self._observers: list[PublicationObserver] = []
        self._posted: deque[tuple[Callable[[], None], CallbackStatistics | None]] = deque()
        self._running = CallbackStatistics()
        self._others_ns = 0
        """Time that the running callback has spent on actions of others, ns."""
        self._wake = Condition()
        self._stopped = False

    # Topics

    def subscribe(self, topic: str, owner: str, handler: Handler) -> LoopSubscription:
        """Call `handler` with each message on `topic`, beginning with the latched message if there is one."""
        timing = self.timing(owner, f"{owner} <- {topic}")
        subscription = LoopSubscription(topic, handler, timing)
        self._topics.setdefault(topic, []).append(subscription)
        if topic in self._latched:
            self._schedule_delivery(subscription, self._latched[topic])
        return subscription

    def unsubscribe(self, subscription: LoopSubscription) -> None:
        """Stop delivery to the subscription, including messages that are already queued."""
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
        """Queue the message for all current subscribers, behind what is already queued at this instant."""
        if self.interceptor is not None and self.interceptor.silences(publisher):
            return
        publication = Publication(topic, message, publisher, from_device, self.now_ns, latched)
        if latched:
            self._latched[topic] = publication
        for observer in self._observers:
            observer(publication)
        for subscription in self._topics.get(topic, ()):
            self._schedule_delivery(subscription, publication)

    def redeliver(self, publication: Publication, subscribers: Callable[[str], bool]) -> None:
        """Deliver a latched publication again to all nodes for whose name `subscribers` is true."""
        for subscription in self._topics.get(publication.topic, ()):
            if subscribers(subscription.timing.owner):
                self._schedule_delivery(subscription, publication)

    def clear_latched(self, publishers: Container[str]) -> None:
        """Drop all latched messages except those of `publishers`, as after a restart."""
        self._latched = {t: p for t, p in self._latched.items() if p.publisher in publishers}

    def latched(self) -> list[Publication]:
        """Return the publications that late-joining subscribers receive."""
        return list(self._latched.values())

    def add_observer(self, observer: PublicationObserver) -> None:
        """Call the observer with every publication, for recording and checking."""
        self._observers.append(observer)

    def remove_observer(self, observer: PublicationObserver) -> None:
        """Do not call the observer any more."""
        self._observers.remove(observer)

    # Time and events

    def schedule(
        self, time_ns: int, rank: int, action: Callable[[], None], timing: CallbackStatistics | None = None
    ) -> ScheduledEvent:
        """Schedule `action` at `time_ns` with the given rank; a time in the past means now."""
        due_ns = time_ns if time_ns > self.now_ns else self.now_ns
        event = ScheduledEvent(action, timing or CallbackStatistics(), due_ns)
        self._sequence += 1
        # the sequence number keeps events of the same time and rank in the order of scheduling
        heapq.heappush(self._events, (due_ns, rank, self._sequence, event))
        return event

    def reschedule(self, event: ScheduledEvent, rank: int, time_ns: int) -> None:
        """Schedule an intercepted event again; it keeps its identity, so that it can still be cancelled."""
        event.due_ns = max(time_ns, self.now_ns)
        self._sequence += 1
        heapq.heappush(self._events, (event.due_ns, rank, self._sequence, event))

    def timing(self, owner: str, name: str, *, from_device: bool = False) -> CallbackStatistics:
        """Return the statistics of the callback `name` of the node `owner`, created on first use."""
        return self.timings.setdefault(name, CallbackStatistics(owner, name, from_device))

    def isolated(self, action: Callable[[T], None]) -> Callable[[T], None]:
        """Wrap `action` so that its time and exceptions count as those of the callback that runs now."""
        timing = self._running

        def run(value: T) -> None:
            event = ScheduledEvent(partial(action, value), timing, self.now_ns)
            if self.interceptor is None or not self.interceptor.intercept(event, MESSAGE):
                self._perform_for(timing, partial(action, value))

        return run

    def post(self, action: Callable[[], None], timing: CallbackStatistics | None = None) -> None:
        """Run `action` in the loop as a device event as soon as possible; safe from any thread."""
        with self._wake:
            self._posted.append((action, timing))
            self._wake.notify()

    def wake(self) -> None:
        """Wake the loop because the clock may have advanced; safe from any thread."""
        with self._wake:
            self._wake.notify()

    def stop(self) -> None:
        """Make `run` return after the current event, or the next `run` at once if none runs; safe from any thread."""
        with self._wake:
            self._stopped = True
            self._wake.notify()

    def run(self, until_ns: int | None = None, until: Callable[[], bool] | None = None) -> None:
        """Run events in order until `until_ns` (inclusive), `until()`, `stop()`, or no event is left."""
        self._clock.start(self.now_ns)
        while until is None or not until():
            if self._stopped:
                self._stopped = False
                return
            if self._posted:
                self._schedule_posted()
            if not self._events:
                break
            due = self._events[0][0]
            if until_ns is not None and due > until_ns:
                self.now_ns = max(self.now_ns, until_ns)
                break
            # wait until the next event is due, unless another thread posts something or stops the loop earlier
            with self._wake:
                interrupted = self._posted or self._stopped
                ready = not interrupted and self._clock.wait_until(due, self._wake)
            if ready and not self._posted:
                self._run_next_event()

    def _schedule_posted(self) -> None:
        """Schedule posted actions, each at an instant of its own, so that a replay keeps their order."""
        while self._posted:
            action, timing = self._posted.popleft()
            self.schedule(self._clock.read(self.now_ns) + 1, DEVICE, action, timing)

    def _run_next_event(self) -> None:
        self.now_ns, rank, _, event = heapq.heappop(self._events)
        if event.action is None:
            return
        if self.interceptor is not None and self.interceptor.intercept(event, rank):
            return
        self.callback_start_ns = start = wall_ns()
        timing = self._running = event.timing
        self._others_ns = 0
        self._perform(timing, event.action)
        elapsed = wall_ns() - start - self._others_ns
        self.callback_start_ns = 0
        timing.calls += 1
        timing.total_ns += elapsed
        if elapsed > timing.worst_ns:
            timing.worst_ns = elapsed

    def _perform_for(self, timing: CallbackStatistics, action: Callable[[], None]) -> None:
        """Perform an action of another callback within the one that runs, and count its time there."""
        running = self._running
        if timing is running:
            self._perform(timing, action)
            return
        start, before_ns = wall_ns(), self._others_ns
        self._running = timing
        self._perform(timing, action)
        self._running = running
        # Time of actions for further callbacks within this one is counted there already
        elapsed = wall_ns() - start
        own_ns = elapsed - (self._others_ns - before_ns)
        self._others_ns = before_ns + elapsed
        timing.total_ns += own_ns
        timing.worst_ns = max(timing.worst_ns, own_ns)

    def _perform(self, timing: CallbackStatistics, action: Callable[[], None]) -> None:
        try:
            action()
        except Exception as error:
            if self.faults is None or not timing.owner:
                raise
            self.faults.handle(timing, error)

    def _schedule_delivery(self, subscription: LoopSubscription, publication: Publication) -> None:
        def deliver() -> None:
            if subscription.active:
                subscription.handler(publication.message)

        time_ns: int | None = self.now_ns
        if self.interceptor is not None:
            time_ns = self.interceptor.delivery_ns(publication, subscription.timing.owner)
        if time_ns is not None:
            self.schedule(time_ns, MESSAGE, deliver, subscription.timing)
