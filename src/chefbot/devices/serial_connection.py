"""A thread that finds a device at the serial ports, reads from it, and reconnects after a disconnection."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

import serial

from chefbot.devices.port_search import TURN, FoundDevice, PortSearch, SerialDevice
from chefbot.devices.serial_ports import (
    Port,
    explain_disconnection,
    find_same_device,
    port_at,
    ports,
    receive,
)
from chefbot.robot.sensors import AUTO
from chefbot.runtime.clock import wall_ns

T = TypeVar("T")
MIN_PAUSE, MAX_PAUSE = 0.1, 0.8
"""Pause between two attempts to find the device, s: it is doubled from the first to the second value."""
TURN_TIMEOUT = 0.1
"""Time to wait for the searches of other devices before it is checked whether the connection ends, s."""


class ConnectionEvents(NamedTuple, Generic[T]):
    """Functions that a connection calls in its thread.

    opened: with the path and what was recognized there. received: with bytes and the time, ns of the wall clock.
    lost: with the reason. missing: with the reason, after each attempt that found no device.
    """

    opened: Callable[[str, T], None]
    received: Callable[[bytes, int], None]
    lost: Callable[[str], None]
    missing: Callable[[str], None]


class SerialConnection(Generic[T]):
    """A reconnecting serial link to a device. `send` may be called from one other thread."""

    def __init__(
        self,
        port: str,
        device: SerialDevice[T],
        events: ConnectionEvents[T],
        others: frozenset[str] = frozenset(),
    ) -> None:
        """`port`: a port's path, or `auto` for any port where the device answers but those of `others`."""
        self._configured_port, self._device, self._events = port, device, events
        self._others = others
        self._last_port: Port | None = None
        self._serial: serial.Serial | None = None
        self._closing = threading.Event()
        self._farewell = b""
        self._thread = threading.Thread(target=self._run, name=device.name, daemon=True)

    def start(self) -> None:
        """Start the thread that searches for the device."""
        self._thread.start()

    def close(self, farewell: bytes = b"") -> None:
        """Send the last bytes, end the thread and close the port."""
        self._farewell = farewell
        self._closing.set()
        self._thread.join()

    def send(self, data: bytes) -> bool:
        """Write without blocking; return False if the data was not written completely: then the device
        receives a damaged message."""
        port = self._serial
        if port is None or not data:
            return port is not None
        try:
            return port.write(data) == len(data)
        except (OSError, TypeError, ValueError):  # pyserial raises any of these if the port was just closed
            return False

    # -- in the thread

    def _run(self) -> None:
        pause = MIN_PAUSE
        while not self._closing.is_set():
            found = self._find()
            if found is None:
                self._closing.wait(pause)
                # Exponential backoff between attempts.
                pause = min(2.0 * pause, MAX_PAUSE)
                continue
            pause = MIN_PAUSE
            self._read(found)

    def _find(self) -> FoundDevice[T] | None:
        search = PortSearch(self._device, self._candidates, alone=self._configured_port != AUTO)
        found = None
        with ExitStack() as stack:
            if self._configured_port == AUTO:
                self._wait_for_turn(stack)
            stack.callback(search.close)
            while found is None and not self._closing.is_set():
                found = search.step()
                if search.exhausted:
                    break
        if found is not None:
            self._last_port = port_at(found.path)
        elif not self._closing.is_set():
            self._events.missing(search.reasons)
        return found

    def _wait_for_turn(self, stack: ExitStack) -> None:
        while not self._closing.is_set():
            if TURN.acquire(timeout=TURN_TIMEOUT):
                stack.callback(TURN.release)
                return

    def _candidates(self) -> list[Port]:
        """Return the device's last known port first, wherever it is now; other ports with `auto` only."""
        last = [] if self._last_port is None else [find_same_device(self._last_port)]
        if self._configured_port != AUTO:
            return last or [port_at(self._configured_port)]
        excluded = {str(Path(path).resolve()) for path in self._others}
        return [*last, *(port for port in ports() if port not in last and port.path not in excluded)]

    def _read(self, found: FoundDevice[T]) -> None:
        port = found.opened
        self._events.opened(found.path, found.recognized)
        self._serial = port
        reason = ""
        try:
            self._receive_until_closed(port)
            if self._farewell:
                port.write(self._farewell)
                port.flush()
            self._device.close(port)
        except OSError as error:
            reason = explain_disconnection(found.path, error, self._device.name)
        self._serial = None
        port.close()
        if not self._closing.is_set():
            self._events.lost(reason)

    def _receive_until_closed(self, port: serial.Serial) -> None:
        while not self._closing.is_set():
            data = receive(port)
            if data:
                self._events.received(data, wall_ns())


def is_missing_path(port: str) -> bool:
    """Return whether a port was given that does not exist."""
    return port != AUTO and not Path(port).exists()
