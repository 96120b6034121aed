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


@contextmanager
def reports_to_service_manager(loop: Loop) -> Iterator[None]:
    """Report to the service manager, if there is one, while the context is entered.

    Without news the manager kills the launch: when the process hangs, or when its loop is busy with one step for
    STEP_TIMEOUT. The loop is stopped if the manager itself dies.
    """
    address = os.environ.pop(SOCKET_VARIABLE, "")  # not for worker processes
    if not address:
        yield
        return
    manager, ending = ServiceManager(address), threading.Event()
    manager.send(READY)
    thread = threading.Thread(target=_report, args=(manager, loop, ending), name="service", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join()
        manager.send(STOPPING)
        manager.close()


def _report(manager: ServiceManager, loop: Loop, ending: threading.Event) -> None:
    while not ending.wait(PERIOD):
        begin_ns = loop.callback_start_ns
        busy = begin_ns != 0 and time.monotonic_ns() - begin_ns > STEP_TIMEOUT * 1e9
        if not busy and not manager.send(ALIVE):
            loop.stop()
            return
