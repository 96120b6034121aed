"""Messages of a launch to the service manager that has started it: systemd, or `chefbot launch --supervised`.

The protocol is that of sd_notify(3): datagrams with assignments to the socket that the environment names.
"""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from chefbot.supervision.heartbeat import HEARTBEAT_TIMEOUT, STEP_TIMEOUT

if TYPE_CHECKING:
    from chefbot.runtime.loop import Loop

SOCKET_VARIABLE = "NOTIFY_SOCKET"
READY, ALIVE, STOPPING = "READY=1", "WATCHDOG=1", "STOPPING=1"
WATCHDOG_TIMEOUT = HEARTBEAT_TIMEOUT
"""Time without a message after which the manager kills the launch, s."""
PERIOD = WATCHDOG_TIMEOUT / 8.0
"""Period of the messages, s."""
CHANGE_TIMEOUT = 600.0
"""Time between two launches of one program, s: on a small computer the second one compiles kernels for minutes."""


class ServiceManager:
    """Reports to the service manager that the launch is ready, that its loop progresses, and that it ends."""

    def __init__(self, address: str) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        # '@' is the kernel's abstract namespace
        self._address = "\0" + address[1:] if address.startswith("@") else address

    def send(self, message: str) -> bool:
        """Send a message; return whether the manager is there."""
        try:
            self._socket.sendto(message.encode(), socket.MSG_DONTWAIT, self._address)
        except BlockingIOError:
            return True  # it is busy: the next message will do
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Close the socket to the service manager."""
        self._socket.close()


class ServiceReports:
    """Reports of a program that runs a launch, perhaps several, one after the other.

    Without news the manager kills the program: when the process hangs, when its loop is busy with one step for
    STEP_TIMEOUT, or when the next launch has not begun after CHANGE_TIMEOUT. The loop is stopped if the manager
    itself dies.
    """

    def __init__(self, address: str) -> None:
        self._manager = ServiceManager(address) if address else None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._report, name="service", daemon=True)
        self._loop: Loop | None = None
        self._loop_ended_at = 0.0

    @contextmanager
    def watching(self, loop: Loop) -> Iterator[None]:
        """Report while the context is entered that the launch of this loop is ready and progresses."""
        self._loop = loop
        if self._manager is not None and self._thread.ident is None:
            self._manager.send(READY)
            self._thread.start()
        try:
            yield
        finally:
            self._loop, self._loop_ended_at = None, time.monotonic()

    def close(self) -> None:
        """Report that the program ends."""
        self._ending.set()
        if self._thread.ident is not None:
            self._thread.join()
        if self._manager is not None:
            self._manager.send(STOPPING)
            self._manager.close()

    def _report(self) -> None:
        assert self._manager is not None
        while not self._ending.wait(PERIOD):
            loop = self._loop
            if not self._hangs(loop) and not self._manager.send(ALIVE) and loop is not None:
                loop.stop()

    def _hangs(self, loop: Loop | None) -> bool:
        if loop is None:
            return time.monotonic() - self._loop_ended_at > CHANGE_TIMEOUT
        begin_ns = loop.callback_start_ns
        return begin_ns != 0 and time.monotonic_ns() - begin_ns > STEP_TIMEOUT * 1e9


@contextmanager
def reports_to_service_manager() -> Iterator[ServiceReports]:
    """Yield the reports to the service manager that the environment names; they do nothing if there is none."""
    reports = ServiceReports(os.environ.pop(SOCKET_VARIABLE, ""))  # not for worker processes
    try:
        yield reports
    finally:
        reports.close()
