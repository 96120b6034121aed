"""Child processes of a launch: started, watched, started again when they die, ended with it."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence

import msgspec

from chefbot.runtime.launch import Launch

LEAST_WAIT, MOST_WAIT = 0.5, 10.0
"""Seconds before a process that died is started again; doubled each time."""
STABLE = 30.0
"""Seconds of life after which the wait begins anew."""
PERIOD = 0.05
GRACE = 2.0
"""Seconds that processes have to end by themselves."""
COMMAND = (sys.executable, "-m", "chefbot.commands.child")


class Order(msgspec.Struct, frozen=True):
    """What a child is told on the first line of its standard input; it ends when that input does."""

    launch: Launch
    """The whole of it."""
    process: str
    folder: str
    """Where an owner's classes lie."""
    domain: int
    port: int


class _Child:
    """One process and its history."""

    def __init__(self, order: Order, command: Sequence[str]) -> None:
        self.name = order.process
        self._order = msgspec.json.encode(order) + b"\n"
        self._command = command
        self.wait = LEAST_WAIT
        self.due = time.monotonic()
        self.began = 0.0
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """In a session of its own: Ctrl-C is the launch's business."""
        self.began = time.monotonic()
        self.process = subprocess.Popen(self._command, stdin=subprocess.PIPE, start_new_session=True)
        assert self.process.stdin is not None
        self.process.stdin.write(self._order)
        self.process.stdin.flush()

    def lost(self) -> int | None:
        """The exit code if it has just died; then it is due again after a while."""
        if self.process is None or self.process.poll() is None:
            return None
        code = self.process.returncode
        self._forget()
        if time.monotonic() - self.began > STABLE:
            self.wait = LEAST_WAIT
        self.due = time.monotonic() + self.wait
        return code

    def back_off(self) -> float:
        """How long it waits now; the next time twice as long."""
        waits, self.wait = self.wait, min(2.0 * self.wait, MOST_WAIT)
        return waits

    def ask_to_end(self) -> None:
        """By the end of its input."""
        if self.process is not None and self.process.stdin is not None:
            self.process.stdin.close()

    def end(self, until: float) -> None:
        """Kill it if it is still there at `until`."""
        if self.process is None:
            return
        try:
            self.process.wait(max(0.0, until - time.monotonic()))
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._forget()

    def _forget(self) -> None:
        if self.process is not None and self.process.stdin is not None:
            self.process.stdin.close()
        self.process = None


class Supervisor:
    """Runs one child for each order until `close`; `tell` gets a sentence when one dies or comes back.

    `lost` gets its name first when it dies. Both are called in its thread.
    A child that this process leaves behind, even by `kill -9`, ends itself.
    """

    def __init__(
        self,
        orders: Sequence[Order],
        tell: Callable[[str], None],
        command: Sequence[str] = COMMAND,
        *,
        lost: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._tell, self._lost = tell, lost
        self._children = [_Child(order, command) for order in orders]
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="supervisor", daemon=True)
        self._thread.start()

    def pids(self) -> dict[str, int]:
        """Process name to number, of those that run."""
        return {one.name: one.process.pid for one in self._children if one.process is not None}

    def close(self) -> None:
        """End them all; at most GRACE seconds and what killing takes."""
        self._closing.set()
        self._thread.join()
        for one in self._children:
            one.ask_to_end()
        until = time.monotonic() + GRACE
        for one in self._children:
            one.end(until)

    def _watch(self) -> None:
        while True:
            for one in self._children:
                self._look_after(one)
            if self._closing.wait(PERIOD):
                return

    def _look_after(self, one: _Child) -> None:
        code = one.lost()
        if code is not None:
            self._lost(one.name)
            self._tell(f"process {one.name} ended ({_reason(code)}); again in {one.back_off():.1f} s")
        if one.process is None and time.monotonic() >= one.due:
            again = one.began > 0.0
            try:
                one.start()
            except OSError as error:
                one.due = time.monotonic() + one.back_off()
                self._tell(f"process {one.name} cannot be started: {error}")
                return
            if again:
                self._tell(f"process {one.name} runs again")


def _reason(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit code {code}"
