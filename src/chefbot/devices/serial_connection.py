"""A thread that finds the board, reads from it, and reconnects after its cable was disconnected."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import serial

from chefbot.board.autodetect import BoardProtocol
from chefbot.devices.board_ports import Port, explain_disconnection, find_same_device, port_at, ports, receive
from chefbot.devices.board_search import BoardSearch, FoundBoard
from chefbot.runtime.clock import wall_ns

AUTO = "auto"
MIN_PAUSE, MAX_PAUSE = 0.1, 0.8
"""Pause between two attempts to find the board, s: it is doubled from the first to the second value."""


class SerialConnection:
    """A reconnecting serial link that calls back in its thread: `on_open(path, dialect)`, `on_data(data,
    wall_ns)`, `on_lost(reason)`.

    `on_missing(reason)` is called after each attempt that found no board. `send` may be called from one other
    thread.
    """

    def __init__(
        self,
        port: str,
        on_open: Callable[[str, BoardProtocol], None],
        on_data: Callable[[bytes, int], None],
        on_lost: Callable[[str], None],
        on_missing: Callable[[str], None],
    ) -> None:
        """`port`: a port's path, or `auto` for any port where a board answers."""
        self._configured_port = port
        self._on_open, self._on_data = on_open, on_data
        self._on_lost, self._on_missing = on_lost, on_missing
        self._last_port: Port | None = None
        self._serial: serial.Serial | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="board", daemon=True)

    def start(self) -> None:
        """Start the thread that searches for the board."""
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the port."""
        self._closing.set()
        self._thread.join()

    def send(self, data: bytes) -> bool:
        """Write without blocking; return False if the data was not written completely: then the board
        receives a damaged line."""
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

    def _find(self) -> FoundBoard | None:
        search, found = BoardSearch(self._candidates), None
        try:
            while found is None and not self._closing.is_set():
                found = search.step()
                if search.exhausted:
                    break
        finally:
            search.close()
        if found is not None:
            self._last_port = port_at(found.path)
        elif not self._closing.is_set():
            self._on_missing(search.reasons)
        return found

    def _candidates(self) -> list[Port]:
        """Return the board's last known port first, wherever it is now; other ports with `auto` only."""
        last = [] if self._last_port is None else [find_same_device(self._last_port)]
        if self._configured_port != AUTO:
            return last or [port_at(self._configured_port)]
        return [*last, *(port for port in ports() if port not in last)]

    def _read(self, found: FoundBoard) -> None:
        port = found.opened
        self._on_open(found.path, found.dialect)
        self._serial = port
        reason = ""
        try:
            while not self._closing.is_set():
                data = receive(port)
                if data:
                    self._on_data(data, wall_ns())
        except OSError as error:
            reason = explain_disconnection(found.path, error)
        self._serial = None
        port.close()
        if not self._closing.is_set():
            self._on_lost(reason)


def is_missing_path(port: str) -> bool:
    """Return whether a port was given that does not exist."""
    return port != AUTO and not Path(port).exists()
