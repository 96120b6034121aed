"""Search for the board: listens at all candidate ports in parallel until a board answers at one of them."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import NamedTuple

import serial

from chefbot.board.autodetect import BoardProtocol, ProtocolProbe
from chefbot.devices.board_ports import Port, explain, open_port, receive
from chefbot.runtime.clock import wall_ns

SCAN_NS = 500_000_000
"""Period at which new ports are looked for, ns."""


class FoundBoard(NamedTuple):
    """An opened port and the protocol that was detected there."""

    opened: serial.Serial
    path: str
    dialect: BoardProtocol


class BoardSearch:
    """One attempt: call `step` until it finds the board or the search is `over`, then `close`.

    Ports that appear during the search take part, so that a board that is plugged in again does not wait for
    the others.
    """

    def __init__(self, candidates: Callable[[], list[Port]]) -> None:
        """`candidates`: returns the current ports, likely ones first."""
        self._candidates = candidates
        self._open: dict[str, tuple[serial.Serial, ProtocolProbe]] = {}
        self._rejected: dict[str, str] = {}
        self._unopened: dict[str, str] = {}
        self._scanned_ns = wall_ns() - SCAN_NS

    def step(self) -> FoundBoard | None:
        """Read from each port once; return the board's port when it is found."""
        if wall_ns() - self._scanned_ns >= SCAN_NS:
            self._scan()
        for path, (opened, probe) in list(self._open.items()):
            try:
                opened.write(probe.data_to_send(wall_ns()))
                # Each port has its own detector; the first verdict ends the search.
                dialect = probe.receive_data(receive(opened), wall_ns())
            except OSError as error:
                self._reject(path, explain(path, error))
                continue
            if dialect is not None:
                del self._open[path]
                return FoundBoard(opened, path, dialect)
            if probe.timed_out(wall_ns()):
                self._reject(path, f"{path}: {probe.failure_reason}")
        return None

    @property
    def exhausted(self) -> bool:
        """Whether no port is left to search."""
        return not self._open

    @property
    def reasons(self) -> str:
        """Why no port is the board's, as a sentence."""
        reasons = [*self._unopened.values(), *self._rejected.values()]
        return "; ".join(reasons) if reasons else "no serial port has anything plugged in"

    def close(self) -> None:
        """Close all ports but the one that was found."""
        for opened, _ in self._open.values():
            opened.close()
        self._open.clear()

    def _scan(self) -> None:
        self._scanned_ns = wall_ns()
        self._unopened.clear()
        for port in self._candidates():
            # Skip ports that are already open or were rejected in this search.
            if port.path in self._open or port.path in self._rejected:
                continue
            try:
                self._open[port.path] = open_port(port.path), ProtocolProbe(os.getpid(), wall_ns())
            except OSError as error:
                self._unopened[port.path] = explain(port.path, error)

    def _reject(self, path: str, reason: str) -> None:
        self._open.pop(path)[0].close()
        self._rejected[path] = reason
