"""Where the board is: all ports that may be its own are listened at together until one of them answers."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import NamedTuple

import serial

from chefbot.board.autodetect import Dialect, Probe
from chefbot.devices.board_ports import Port, explain, open_port, receive
from chefbot.runtime.clock import wall_ns

SCAN_NS = 500_000_000
"""Pause between two looks at which ports there are."""


class Found(NamedTuple):
    """An opened port and what speaks there."""

    opened: serial.Serial
    path: str
    dialect: Dialect


class BoardSearch:
    """One attempt: `step` until it finds the board or the search is `over`, then `close`.

    Ports that appear meanwhile take part, so that a board which is plugged in again does not wait for the others.
    """

    def __init__(self, candidates: Callable[[], list[Port]]) -> None:
        """`candidates`: the ports of this moment, likely ones first."""
        self._candidates = candidates
        self._open: dict[str, tuple[serial.Serial, Probe]] = {}
        self._given_up: dict[str, str] = {}
        self._refused: dict[str, str] = {}
        self._scanned_ns = wall_ns() - SCAN_NS

    def step(self) -> Found | None:
        """Listen once at each port."""
        if wall_ns() - self._scanned_ns >= SCAN_NS:
            self._scan()
        for path, (opened, probe) in list(self._open.items()):
            try:
                opened.write(probe.ask(wall_ns()))
                dialect = probe.hear(receive(opened), wall_ns())
            except OSError as error:
                self._give_up(path, explain(path, error))
                continue
            if dialect is not None:
                del self._open[path]
                return Found(opened, path, dialect)
            if probe.over(wall_ns()):
                self._give_up(path, f"{path}: {probe.impression}")
        return None

    @property
    def over(self) -> bool:
        """No port is left to listen at."""
        return not self._open

    @property
    def reasons(self) -> str:
        """Why no port is the board's, in words."""
        why = [*self._refused.values(), *self._given_up.values()]
        return "; ".join(why) if why else "no serial port has anything plugged in"

    def close(self) -> None:
        """Free all ports but the one that was found."""
        for opened, _ in self._open.values():
            opened.close()
        self._open.clear()

    def _scan(self) -> None:
        self._scanned_ns = wall_ns()
        self._refused.clear()
        for port in self._candidates():
            if port.path in self._open or port.path in self._given_up:
                continue
            try:
                self._open[port.path] = open_port(port.path), Probe(os.getpid(), wall_ns())
            except OSError as error:
                self._refused[port.path] = explain(port.path, error)

    def _give_up(self, path: str, why: str) -> None:
        self._open.pop(path)[0].close()
        self._given_up[path] = why
