"""Callbacks of a node that wait: until the node's hang ends, or until the one before has taken its time."""

from __future__ import annotations

from functools import partial

from chefbot.runtime.loop import MESSAGE, Loop, ScheduledEvent

QUEUE_DEPTH = 10
"""Messages of one topic that a queue keeps, as in ROS 2's default QoS; the oldest is dropped."""


class CallbackQueue:
    """The waiting callbacks of one node, in their order.

    duration_ns: time that each callback takes; None: none runs until `release`.
    """

    def __init__(self, loop: Loop, duration_ns: int | None) -> None:
        self._loop, self._duration_ns = loop, duration_ns
        self._waiting: list[tuple[ScheduledEvent, int]] = []
        self._running: tuple[ScheduledEvent, int] | None = None
        """The callback whose time is passing; it runs at the end of it."""
        self._end: ScheduledEvent | None = None

    def intercept(self, event: ScheduledEvent, rank: int) -> bool:
        """Return whether the due callback has to wait."""
        if self._running is not None and event is self._running[0]:
            self._running = None
            self._start_next()
            return False
        self._waiting.append((event, rank))
        if rank == MESSAGE:
            self._drop_oldest(event)
        if self._running is None or self._running[0].action is None:  # cancelled in the meantime
            self._start_next()
        return True

    def release(self) -> None:
        """Let all callbacks run now: that whose time is passing, then those that wait."""
        if self._end is not None:
            self._end.cancel()
        running, self._running = self._running, None
        for event, rank in [*([running] if running else []), *self._waiting]:
            self._loop.reschedule(event, rank, self._loop.now_ns)
        self._waiting.clear()

    def _drop_oldest(self, newest: ScheduledEvent) -> None:
        same = [item for item in self._waiting if item[1] == MESSAGE and item[0].timing is newest.timing]
        if len(same) > QUEUE_DEPTH:
            self._waiting.remove(same[0])

    def _start_next(self) -> None:
        """Let the time of the next callback pass, after which it is due again and not intercepted."""
        if self._end is not None:
            self._end.cancel()
        self._waiting = [item for item in self._waiting if item[0].action is not None]
        if self._duration_ns is not None and self._waiting:
            self._running = event, rank = self._waiting.pop(0)
            end_ns = self._loop.now_ns + self._duration_ns
            run = partial(self._loop.reschedule, event, rank, end_ns)
            self._end = self._loop.schedule(end_ns, rank, run)
