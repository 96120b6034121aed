"""A thread that finds the board, reads it, and finds it again when its cable was pulled."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import serial

from chefbot.board.autodetect import Dialect
from chefbot.devices.board_ports import Port, broken, port_at, ports, receive, same_device
from chefbot.devices.board_search import BoardSearch, Found
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
            self._read(found)

    def _find(self) -> Found | None:
        search, found = BoardSearch(self._candidates), None
        try:
            while found is None and not self._ending.is_set():
                found = search.step()
                if search.over:
                    break
        finally:
            search.close()
        if found is not None:
            self._known = port_at(found.path)
        elif not self._ending.is_set():
            self._on_missing(search.reasons)
        return found

    def _candidates(self) -> list[Port]:
        """The board's own port first, wherever it is now; other ports in `auto` only."""
        known = [] if self._known is None else [same_device(self._known)]
        if self._wanted != AUTO:
            return known or [port_at(self._wanted)]
        return [*known, *(port for port in ports() if port not in known)]

    def _read(self, found: Found) -> None:
        opened = found.opened
        self._on_open(found.path, found.dialect)
        self._serial = opened
        why = ""
        try:
            while not self._ending.is_set():
                data = receive(opened)
                if data:
                    self._on_data(data, wall_ns())
        except OSError as error:
            why = broken(found.path, error)
        self._serial = None
        opened.close()
        if not self._ending.is_set():
            self._on_lost(why)


def missing_path(wanted: str) -> bool:
    """Whether a port was named that does not exist."""
    return wanted != AUTO and not Path(wanted).exists()
