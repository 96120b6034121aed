"""A parent process for a launch: it starts it again when it has crashed or hangs.

It uses the protocol of systemd, for computers and containers without it.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from chefbot.errors import UserError
from chefbot.supervision.restart_delay import MAX_RESTART_DELAY, MIN_RESTART_DELAY, STABLE_TIME
from chefbot.supervision.service_manager import (
    ALIVE,
    READY,
    SOCKET_VARIABLE,
    STOPPING,
    WATCHDOG_TIMEOUT,
)

USER_ERROR, INTERRUPTED = 2, 130
ORDERLY_CODES = (0, USER_ERROR, INTERRUPTED)
"""Exit codes after which a launch is not started again: its end, bad input, Ctrl-C."""
START_TIMEOUT = 600.0
"""Time in which a launch has to be ready, s: on a small computer it compiles kernels for minutes the first time."""
PERIOD = 0.05
"""Period of the checks, s."""
FORWARD_DELAY = 1.0
"""Time in which the launch has to end after Ctrl-C before the signal is passed on, s: a terminal sends it to all."""
END_TIMEOUT = 10.0
"""Time in which the launch has to end after a request, s."""
Log = Callable[[str], None]


class SupervisedLaunch:
    """One process of a launch, and what it has reported."""

    def __init__(self, command: Sequence[str], address: Path, receiver: socket.socket) -> None:
        self._receiver = receiver
        self._receive()  # messages of the process before
        self.process = subprocess.Popen(command, env={**os.environ, SOCKET_VARIABLE: str(address)})
        self.started_at = self._reported_at = time.monotonic()
        self.ready = self.stopping = False

    def poll(self) -> int | None:
        """Return its exit code if it has ended; kill it if it hangs."""
        for message in self._receive():
            self._reported_at = time.monotonic()
            self.ready |= message == READY
            self.stopping |= message == STOPPING
        if self.hangs:
            self.process.kill()
        return self.process.poll()

    @property
    def hangs(self) -> bool:
        """Whether it has reported nothing for too long."""
        limit = WATCHDOG_TIMEOUT if self.ready else START_TIMEOUT
        return not self.stopping and time.monotonic() - self._reported_at > limit

    def has_crashed(self, code: int) -> bool:
        """Return whether an end with this exit code is not an orderly one."""
        return not self.stopping and code not in ORDERLY_CODES

    def _receive(self) -> list[str]:
        messages = []
        with contextlib.suppress(BlockingIOError):
            while True:
                messages.append(self._receiver.recv(256).decode(errors="replace"))
        return [message for message in messages if message in (READY, ALIVE, STOPPING)]


class LaunchParent:
    """Runs a launch until its orderly end, and starts it again, after a growing delay, when it has crashed."""

    def __init__(self, command: Sequence[str], log: Log) -> None:
        self._command, self._log = command, log
        self._request: tuple[int, float] | None = None
        """The signal that requests the end, and when it came; None before."""

    def run(self) -> int:
        """Return the exit code of the launch's last process."""
        delay = MIN_RESTART_DELAY
        with _receiver() as (address, receiver), self._signals_received():
            while True:
                launch = SupervisedLaunch(self._command, address, receiver)
                code = self._wait(launch)
                if self._request is not None or not launch.has_crashed(code):
                    return code if code >= 0 else 128 - code
                if time.monotonic() - launch.started_at > STABLE_TIME:
                    delay = MIN_RESTART_DELAY
                self._log(f"The launch ended ({_reason(launch, code)}); it starts again in {delay:.1f} s.")
                if self._pause(delay):
                    return 0
                delay = min(2.0 * delay, MAX_RESTART_DELAY)

    def _wait(self, launch: SupervisedLaunch) -> int:
        """Wait for the end of the process; pass on a request to end, and kill the process if that does not help."""
        passed_on = False
        while (code := launch.poll()) is None:
            if self._request is not None:
                number, at = self._request
                waited = time.monotonic() - at
                if not passed_on and (number == signal.SIGTERM or waited > FORWARD_DELAY):
                    passed_on = True
                    launch.process.send_signal(number)
                if waited > END_TIMEOUT:
                    launch.process.kill()
            time.sleep(PERIOD)
        return code

    def _pause(self, seconds: float) -> bool:
        """Wait; return whether the end was requested meanwhile."""
        end = time.monotonic() + seconds
        while self._request is None and time.monotonic() < end:
            time.sleep(PERIOD)
        return self._request is not None

    @contextlib.contextmanager
    def _signals_received(self) -> Iterator[None]:
        def handle(number: int, _: object) -> None:
            self._request = self._request or (number, time.monotonic())

        previous = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in previous.items():
                signal.signal(number, handler)


def run_supervised(arguments: Sequence[str], log: Log) -> int:
    """Run `chefbot` with these arguments as a supervised launch, and return its exit code."""
    if not hasattr(socket, "AF_UNIX"):
        raise UserError("--supervised works on Linux and macOS only; leave it out")
    return LaunchParent([sys.executable, "-m", "chefbot", *arguments], log).run()


@contextlib.contextmanager
def _receiver() -> Iterator[tuple[Path, socket.socket]]:
    """Yield a new socket for the messages of the launch, and its address."""
    with (
        tempfile.TemporaryDirectory(prefix="chefbot_") as folder,
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver,
    ):
        address = Path(folder) / "notify"
        receiver.bind(str(address))
        receiver.setblocking(False)
        yield address, receiver


def _reason(launch: SupervisedLaunch, code: int) -> str:
    if launch.hangs:
        return f"no sign of life for {WATCHDOG_TIMEOUT:.0f} s"
    return f"signal {-code}" if code < 0 else f"exit code {code}"
