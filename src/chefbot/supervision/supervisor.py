"""Supervisor of a launch's worker processes: starts, watches, restarts and ends them."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import msgspec

from chefbot.supervision.heartbeat import HeartbeatMonitor
from chefbot.supervision.restart_delay import MAX_RESTART_DELAY, MIN_RESTART_DELAY, STABLE_TIME
from chefbot.supervision.state_handover import StoredMessage
from chefbot.supervision.worker_process import KILL_TIMEOUT, WorkerProcess, WorkerSpec

PERIOD = 0.02
"""Period of the watch loop, s; the exit of a child wakes it at once."""
SPARE_DELAY = 2.0
"""Time that all processes must have been running before a spare is started, s, as starting needs the CPU."""
COMMAND = (sys.executable, "-m", "chefbot.launcher.worker")


class SupervisorCallbacks(NamedTuple):
    """Callbacks of a supervisor; all are called in its thread."""

    on_down: Callable[[str], None] = lambda _: None
    """Called with the name of a process that has died or does not respond, before anything else is done."""
    is_ready: Callable[[str], bool] = lambda _: True
    """Return whether a process that runs is ready to work."""
    on_up: Callable[[str], None] = lambda _: None
    """Called when a process is ready or responds again, also after its first start."""
    restored_messages: Callable[[str], tuple[StoredMessage, ...]] = lambda _: ()
    """Return the messages that restore the state of a process after a restart."""


class _Child:
    """A worker process with its restart history."""

    def __init__(self, order: WorkerSpec) -> None:
        self.name = order.process
        self.order = order
        self.restart_delay = MIN_RESTART_DELAY
        self.restart_at = time.monotonic()
        self.started_at = 0.0
        self.died_at: float | None = None
        """Monotonic time of its last death, s; None if it has not died yet."""
        self.ready = False
        self.running: WorkerProcess | None = None
        self.monitor = HeartbeatMonitor(order.max_silence)
        self.unresponsive_since: float | None = None
        """Monotonic time since which it has not responded, s; None if it responds."""

    @property
    def is_starting(self) -> bool:
        """Whether it runs and responds, and is not known to be ready yet."""
        return self.running is not None and not self.ready and not self.monitor.is_unresponsive

    def poll_exit(self) -> int | None:
        """Return the exit code if the process has just died, and schedule its restart."""
        code = None if self.running is None else self.running.process.poll()
        if self.running is None or code is None:
            return None
        self.running.request_exit()
        self.running = None
        self.died_at = time.monotonic()
        # exponential backoff, reset after a stable run
        if self.died_at - self.started_at > STABLE_TIME:
            self.restart_delay = MIN_RESTART_DELAY
        self.restart_at = self.died_at + self.restart_delay
        return code

    def back_off(self) -> float:
        """Return the current restart delay and double it for the next time, up to the maximum."""
        delay, self.restart_delay = self.restart_delay, min(2.0 * self.restart_delay, MAX_RESTART_DELAY)
        return delay


class Supervisor:
    """Runs one worker process for each order until `close`; `log` gets a sentence when one dies or is back.

    A spare process with everything loaded stands by, so that a process that died is soon replaced. Children
    exit by themselves when this process does, even by `kill -9`.
    """

    def __init__(
        self,
        workers: Sequence[WorkerSpec],
        log: Callable[[str], None],
        command: Sequence[str] = COMMAND,
        *,
        hooks: SupervisorCallbacks = SupervisorCallbacks(),  # noqa: B008 - it is frozen
    ) -> None:
        self._log, self._command, self._hooks = log, command, hooks
        self._children = [_Child(order) for order in workers]
        self._spare: WorkerProcess | None = None
        self._wake = threading.Event()
        self._last_check = time.monotonic()
        self._closing = False
        self._thread = threading.Thread(target=self._watch, name="supervisor", daemon=True)
        self._thread.start()

    def pids(self) -> dict[str, int]:
        """Return the process id of each running process by its name."""
        return {
            child.name: child.running.process.pid for child in self._children if child.running is not None
        }

    def close(self) -> None:
        """End all processes; takes KILL_TIMEOUT seconds and the time of killing at most."""
        self._closing = True
        self._wake.set()
        self._thread.join()
        running = [child.running for child in self._children if child.running is not None]
        for worker in running:
            worker.request_exit()
        if self._spare is not None:
            self._spare.end(0.0)  # it has no work to finish
        deadline = time.monotonic() + KILL_TIMEOUT
        for worker in running:
            worker.end(max(0.0, deadline - time.monotonic()))
        for child in self._children:
            child.running = None

    def _watch(self) -> None:
        while not self._closing:
            self._wake.clear()
            now = time.monotonic()
            # bounded, as heartbeats may still be in transit if this thread was late
            elapsed, self._last_check = min(now - self._last_check, 2.0 * PERIOD), now
            for child in self._children:
                self._check_heartbeat(child, elapsed)
                self._check_process(child)
            if self._children and self._spare is None and all(map(_is_settled, self._children)):
                self._start_spare()
            self._wake.wait(PERIOD)

    def _check_heartbeat(self, child: _Child, elapsed: float) -> None:
        """Report a process that stops or resumes responding, and kill one that hangs."""
        if child.running is None:
            return
        child.monitor.update(child.running.heartbeats(), elapsed)
        if child.monitor.kill_reason:
            child.running.process.kill()
        if not child.ready or child.monitor.is_unresponsive == (child.unresponsive_since is not None):
            return
        if child.unresponsive_since is None:
            self._hooks.on_down(child.name)
            child.unresponsive_since = time.monotonic()
        else:
            self._hooks.on_up(child.name)
            duration, child.unresponsive_since = time.monotonic() - child.unresponsive_since, None
            self._log(f"process {child.name} did not respond; the robot was stopped for {duration:.2f} s")

    def _check_process(self, child: _Child) -> None:
        code = child.poll_exit()
        if code is not None:
            self._hooks.on_down(child.name)
            delay, reason = child.back_off(), child.monitor.kill_reason or _exit_reason(code)
            self._log(f"process {child.name} ended ({reason}); restart in {delay:.1f} s")
        if child.running is None and time.monotonic() >= child.restart_at:
            self._start(child)
        if child.is_starting and self._hooks.is_ready(child.name):
            child.ready = True
            self._hooks.on_up(child.name)
            if child.died_at is not None:
                duration = time.monotonic() - child.died_at
                self._log(f"process {child.name} is ready again, {duration:.1f} s after it died")

    def _start(self, child: _Child) -> None:
        restarted = child.died_at is not None
        spare, self._spare = self._spare, None  # a spare has everything loaded already
        order = child.order
        if restarted:
            order = msgspec.structs.replace(
                order, restored_messages=self._hooks.restored_messages(child.name)
            )
        try:
            child.running = spare or WorkerProcess(order.preload_spec, self._command)
        except OSError as error:
            child.restart_at = time.monotonic() + child.back_off()
            self._log(f"process {child.name} cannot be started: {error}")
            return
        child.started_at, child.ready = time.monotonic(), False
        child.monitor, child.unresponsive_since = HeartbeatMonitor(order.max_silence), None
        child.running.assign(order, self._wake.set)
        if restarted:
            self._log(f"process {child.name} restarted")

    def _start_spare(self) -> None:
        """Start the spare; any child's specification will do, as all preload the same."""
        try:
            preparation = msgspec.structs.replace(self._children[0].order.preload_spec, spare=True)
            self._spare = WorkerProcess(preparation, self._command)
        except OSError as error:
            self._log(f"a spare process cannot be started: {error}")


def _is_settled(child: _Child) -> bool:
    return child.ready and child.running is not None and time.monotonic() - child.started_at > SPARE_DELAY


def _exit_reason(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit code {code}"
