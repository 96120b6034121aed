"""A thread that finds the board, reads it, and finds it again when its cable was pulled."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path

import serial

from chefbot.devices.board_ports import Port, broken, explain, open_port, port_at, ports, same_device
from chefbot.devices.line.probe import Dialect, Probe
from chefbot.runtime.clock import wall_ns

AUTO = "auto"
FIRST_PAUSE, LONGEST_PAUSE = 0.1, 0.8
"""Seconds between two attempts to find the board; each pause is twice the one before."""


class BoardLine:
    """Calls back, in its thread: `on_open(path, dialect)`, `on_data(data, wall_ns)`, `on_lost(why)`.

    `on_missing(why)` is called after each attempt that found no board. `send` is for any one other thread.
    """

    def __init__(
        self,
        wanted: str,
        on_open: Callable[[str, Dialect], None],
        on_data: Callable[[bytes, int], None],
        on_lost: Callable[[str], None],
        on_missing: Callable[[str], None],
    ) -> None:
        """`wanted`: a path, or `auto` for whichever port a board answers at."""
        self._wanted = wanted
        self._on_open, self._on_data = on_open, on_data
        self._on_lost, self._on_missing = on_lost, on_missing
        self._known: Port | None = None
        self._serial: serial.Serial | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="board", daemon=True)

    def start(self) -> None:
        """Begin to look for the board."""
        self._thread.start()

    def close(self) -> None:
        """End the thread and free the port."""
        self._ending.set()
        self._thread.join()

    def send(self, data: bytes) -> bool:
        """Without waiting; False if not all of it went: then the board sees one damaged line."""
        port = self._serial
        if port is None or not data:
            return port is not None
        try:
            return port.write(data) == len(data)
        except (OSError, TypeError, ValueError):  # pyserial's ways to say that the port was just closed
            return False

    # -- in the thread

    def _run(self) -> None:
        pause = FIRST_PAUSE
        while not self._ending.is_set():
            found = self._find()
            if found is None:
                self._ending.wait(pause)
                pause = min(2.0 * pause, LONGEST_PAUSE)
                continue
            pause = FIRST_PAUSE
            self._read(*found)

    def _find(self) -> tuple[serial.Serial, str, Dialect] | None:
        tried = []
        for port in self._candidates():
            try:
                found = self._try(port)
            except OSError as error:
                tried.append(explain(port.path, error))
                continue
            if not isinstance(found, str):
                self._known = port_at(port.path)
                return found[0], port.path, found[1]
            tried.append(f"{port.path}: {found}")
        if not self._ending.is_set():
            self._on_missing("; ".join(tried) if tried else "no serial port has anything plugged in")
        return None

    def _candidates(self) -> list[Port]:
        """The board's own port first, wherever it is now; other ports in `auto` only."""
        known = [] if self._known is None else [same_device(self._known)]
        if self._wanted != AUTO:
            return known or [port_at(self._wanted)]
        return [*known, *(port for port in ports() if port not in known)]

    def _try(self, port: Port) -> tuple[serial.Serial, Dialect] | str:
        """The opened port and what speaks there, or the impression that it made. OSError."""
        opened = open_port(port.path)
        try:
            probe = Probe(os.getpid(), wall_ns())
            while not self._ending.is_set() and not probe.over(wall_ns()):
                opened.write(probe.ask(wall_ns()))
                dialect = probe.hear(_receive(opened), wall_ns())
                if dialect is not None:
                    return opened, dialect
        except BaseException:
            opened.close()
            raise
        opened.close()
        return probe.impression

    def _read(self, opened: serial.Serial, path: str, dialect: Dialect) -> None:
        self._on_open(path, dialect)
        self._serial = opened
        why = ""
        try:
            while not self._ending.is_set():
                data = _receive(opened)
                if data:
                    self._on_data(data, wall_ns())
        except OSError as error:
            why = broken(path, error)
        self._serial = None
        opened.close()
        if not self._ending.is_set():
            self._on_lost(why)


def _receive(opened: serial.Serial) -> bytes:
    """What is there; waits READ_TIMEOUT for a first byte. OSError when the port is gone."""
    first = bytes(opened.read(1))
    waiting = opened.in_waiting if first else 0
    return first + bytes(opened.read(waiting)) if waiting else first


def missing_path(wanted: str) -> bool:
    """Whether a port was named that does not exist."""
    return wanted != AUTO and not Path(wanted).exists()
