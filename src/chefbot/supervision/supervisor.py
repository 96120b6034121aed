"""Child processes of a launch: started, watched, started again when they die or hang, ended with it."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import msgspec

from chefbot.supervision.heartbeat import Pulse
from chefbot.supervision.state_handover import Word
from chefbot.supervision.worker_process import Order, Prepared

LEAST_WAIT, MOST_WAIT = 0.5, 10.0
"""Seconds before a process that died is started again; doubled each time."""
STABLE = 10.0
"""Seconds of life after which the wait begins anew."""
PERIOD = 0.02
"""Seconds between two looks; the end of a child is seen at once."""
GRACE = 2.0
"""Seconds that processes have to end by themselves."""
SPARE_AFTER = 2.0
"""Seconds that all are there before a spare is made: what starts has enough to do."""
COMMAND = (sys.executable, "-m", "chefbot.launcher.worker")


class Hooks(NamedTuple):
    """What a supervisor asks and tells whom it works for; all are called in its thread."""

    lost: Callable[[str], None] = lambda _: None
    """A process has died, or does not answer; said before anything else."""
    ready: Callable[[str], bool] = lambda _: True
    """Whether a process that runs does its work yet."""
    back: Callable[[str], None] = lambda _: None
    """It does now, or again; said of the first start too."""
    last_words: Callable[[str], tuple[Word, ...]] = lambda _: ()
    """What a process that died has to know of the life before."""


class _Child:
    """One process and its history."""

    def __init__(self, order: Order) -> None:
        self.name = order.process
        self.order = order
        self.wait = LEAST_WAIT
        self.due = time.monotonic()
        self.began = 0.0
        self.died: float | None = None
        """When, if it has died before; monotonic seconds."""
        self.ready = False
        self.running: Prepared | None = None
        self.pulse = Pulse()
        self.weak_since: float | None = None
        """When it was first felt that it does not answer, if it does not."""

    @property
    def begins_to_work(self) -> bool:
        """It runs, and nobody has said yet that all of it is there."""
        return self.running is not None and not self.ready and not self.pulse.is_weak

    def lost(self) -> int | None:
        """The exit code if it has just died; then it is due again after a while."""
        code = None if self.running is None else self.running.process.poll()
        if self.running is None or code is None:
            return None
        self.running.ask_to_end()
        self.running = None
        self.died = time.monotonic()
        if self.died - self.began > STABLE:
            self.wait = LEAST_WAIT
        self.due = self.died + self.wait
        return code

    def back_off(self) -> float:
        """How long it waits now; the next time twice as long."""
        waits, self.wait = self.wait, min(2.0 * self.wait, MOST_WAIT)
        return waits


class Supervisor:
    """Runs one child for each order until `close`; `tell` gets a sentence when one dies or comes back.

    A spare that has everything loaded stands by, so that who dies is soon replaced. A child that this process leaves
    behind, even by `kill -9`, ends itself.
    """

    def __init__(
        self,
        orders: Sequence[Order],
        tell: Callable[[str], None],
        command: Sequence[str] = COMMAND,
        *,
        hooks: Hooks = Hooks(),  # noqa: B008 - it is frozen
    ) -> None:
        self._tell, self._command, self._hooks = tell, command, hooks
        self._children = [_Child(order) for order in orders]
        self._spare: Prepared | None = None
        self._news = threading.Event()
        self._looked = time.monotonic()
        self._closing = False
        self._thread = threading.Thread(target=self._watch, name="supervisor", daemon=True)
        self._thread.start()

    def pids(self) -> dict[str, int]:
        """Process name to number, of those that run."""
        return {one.name: one.running.process.pid for one in self._children if one.running is not None}

    def close(self) -> None:
        """End them all; at most GRACE seconds and what killing takes."""
        self._closing = True
        self._news.set()
        self._thread.join()
        running = [one.running for one in self._children if one.running is not None]
        for one in running:
            one.ask_to_end()
        if self._spare is not None:
            self._spare.end(0.0)  # it has done nothing yet
        until = time.monotonic() + GRACE
        for one in running:
            one.end(max(0.0, until - time.monotonic()))
        for child in self._children:
            child.running = None

    def _watch(self) -> None:
        while not self._closing:
            self._news.clear()
            now = time.monotonic()
            elapsed, self._looked = min(now - self._looked, 2.0 * PERIOD), now
            for one in self._children:
                self._feel(one, elapsed)
                self._look_after(one)
            if self._children and self._spare is None and all(map(_is_settled, self._children)):
                self._make_spare()
            self._news.wait(PERIOD)

    def _feel(self, one: _Child, elapsed: float) -> None:
        """The robot stands while one does not answer; it goes on when it does, and one that hangs is ended."""
        if one.running is None:
            return
        one.pulse.feel(one.running.signs(), elapsed)
        if one.pulse.verdict:
            one.running.process.kill()
        if not one.ready or one.pulse.is_weak == (one.weak_since is not None):
            return
        if one.weak_since is None:
            self._hooks.lost(one.name)
            one.weak_since = time.monotonic()
        else:
            self._hooks.back(one.name)
            took, one.weak_since = time.monotonic() - one.weak_since, None
            self._tell(f"process {one.name} did not answer; the robot stood for {took:.2f} s")

    def _look_after(self, one: _Child) -> None:
        code = one.lost()
        if code is not None:
            self._hooks.lost(one.name)
            waits, why = one.back_off(), one.pulse.verdict or _reason(code)
            self._tell(f"process {one.name} ended ({why}); again in {waits:.1f} s")
        if one.running is None and time.monotonic() >= one.due:
            self._start(one)
        if one.begins_to_work and self._hooks.ready(one.name):
            one.ready = True
            self._hooks.back(one.name)
            if one.died is not None:
                took = time.monotonic() - one.died
                self._tell(f"process {one.name} is back, {took:.1f} s after its end")

    def _start(self, one: _Child) -> None:
        again = one.died is not None
        spare, self._spare = self._spare, None
        order = one.order
        if again:
            order = msgspec.structs.replace(order, last_words=self._hooks.last_words(one.name))
        try:
            one.running = spare or Prepared(order.preparation, self._command)
        except OSError as error:
            one.due = time.monotonic() + one.back_off()
            self._tell(f"process {one.name} cannot be started: {error}")
            return
        one.began, one.ready = time.monotonic(), False
        one.pulse, one.weak_since = Pulse(), None
        one.running.give(order, self._news.set)
        if again:
            self._tell(f"process {one.name} runs again")

    def _make_spare(self) -> None:
        """Of any of them: all load the same."""
        try:
            preparation = msgspec.structs.replace(self._children[0].order.preparation, spare=True)
            self._spare = Prepared(preparation, self._command)
        except OSError as error:
            self._tell(f"a spare process cannot be started: {error}")


def _is_settled(one: _Child) -> bool:
    return one.ready and one.running is not None and time.monotonic() - one.began > SPARE_AFTER


def _reason(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit code {code}"
