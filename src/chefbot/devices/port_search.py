"""Search for a device: listens at all candidate ports in parallel until the device is recognized at one of them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, NamedTuple, Protocol, TypeVar

import serial

from chefbot.devices.serial_ports import Port, explain, receive
from chefbot.runtime.clock import wall_ns

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
SCAN_NS = 500_000_000
"""Period at which new ports are looked for, ns."""
TURN = threading.Lock()
"""Held by a search at all ports: those of several devices take turns, as a port can be opened by one of them only."""


class PortProbe(Protocol[T_co]):
    """Recognizes a device at one port by what it sends."""

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the bytes to send now; b"" for none."""

    def receive_data(self, data: bytes, now_ns: int) -> T_co | None:
        """Process received bytes; return what was recognized, None as long as it is unknown."""

    def timed_out(self, now_ns: int) -> bool:
        """Return whether the device is not there."""

    @property
    def failure_reason(self) -> str:
        """What was received instead, as a sentence for the operator."""


class SerialDevice(NamedTuple, Generic[T]):
    """How a kind of device is opened and recognized.

    name: for messages. open: opens a port by its path, OSError if that fails. probe: returns a probe of an open
    port that begins at a time, ns; its last argument is whether this is the only port that comes into question.
    close: called before the port is closed for good. rivals_ns: time for which a second device of the kind is looked
    for after the first was found, ns.
    """

    name: str
    open: Callable[[str], serial.Serial]
    probe: Callable[[serial.Serial, int, bool], PortProbe[T]]
    close: Callable[[serial.Serial], None] = lambda _: None
    rivals_ns: int = 0


class FoundDevice(NamedTuple, Generic[T]):
    """An opened port and what was recognized there."""

    opened: serial.Serial
    path: str
    recognized: T


class PortSearch(Generic[T]):
    """One attempt: call `step` until it finds the device or the search is `exhausted`, then `close`.

    Ports that appear during the search take part, so that a device that is plugged in again does not wait for
    the others.
    """

    def __init__(
        self, device: SerialDevice[T], candidates: Callable[[], list[Port]], *, alone: bool = False
    ) -> None:
        """`candidates`: returns the current ports, likely ones first; `alone`: whether it is always one port."""
        self._device, self._candidates, self._alone = device, candidates, alone
        self._open: dict[str, tuple[serial.Serial, PortProbe[T]]] = {}
        self._rejected: dict[str, str] = {}
        self._unopened: dict[str, str] = {}
        self._found: list[FoundDevice[T]] = []
        self._found_ns = 0
        self._scanned_ns = wall_ns() - SCAN_NS

    def step(self) -> FoundDevice[T] | None:
        """Read from each port once; return the device's port when it is known to be the only one."""
        if wall_ns() - self._scanned_ns >= SCAN_NS:
            self._scan()
        for path, (opened, probe) in list(self._open.items()):
            self._listen(path, opened, probe)
            if self._found and not self._device.rivals_ns:
                break
        if len(self._found) > 1:
            self._reject_all()
        over = wall_ns() - self._found_ns >= self._device.rivals_ns or not self._open or self._alone
        return self._found.pop() if self._found and over else None

    @property
    def exhausted(self) -> bool:
        """Whether no port is left to search."""
        return not self._open and not self._found

    @property
    def reasons(self) -> str:
        """Why no port is the device's, as a sentence."""
        reasons = [*self._unopened.values(), *self._rejected.values()]
        return "; ".join(dict.fromkeys(reasons)) if reasons else "no serial port has anything plugged in"

    def close(self) -> None:
        """Close all ports but the one that was returned."""
        for opened in [*(opened for opened, _ in self._open.values()), *(one.opened for one in self._found)]:
            opened.close()
        self._open.clear()
        self._found.clear()

    def _listen(self, path: str, opened: serial.Serial, probe: PortProbe[T]) -> None:
        try:
            opened.write(probe.data_to_send(wall_ns()))
            recognized = probe.receive_data(receive(opened), wall_ns())
        except OSError as error:
            self._reject(path, explain(path, error, self._device.name))
            return
        if recognized is not None:
            del self._open[path]
            self._found.append(FoundDevice(opened, path, recognized))
            self._found_ns = wall_ns()
        elif probe.timed_out(wall_ns()):
            self._reject(path, f"{path}: {probe.failure_reason}")

    def _scan(self) -> None:
        self._scanned_ns = wall_ns()
        self._unopened.clear()
        for port in self._candidates():
            # Skip ports that are already open or were rejected in this search.
            known = (*self._open, *self._rejected, *(one.path for one in self._found))
            if port.path in known:
                continue
            try:
                opened = self._device.open(port.path)
            except OSError as error:
                self._unopened[port.path] = explain(port.path, error, self._device.name)
            else:
                self._open[port.path] = opened, self._device.probe(opened, wall_ns(), self._alone)

    def _reject(self, path: str, reason: str) -> None:
        self._open.pop(path)[0].close()
        self._rejected[path] = reason

    def _reject_all(self) -> None:
        """Reject several devices of the kind: the owner has to name the port of the robot's device."""
        places = " and at ".join(sorted(one.path for one in self._found))
        reason = f"there is a {self._device.name} at {places}: name the port of the robot's"
        for one in self._found:
            one.opened.close()
            self._rejected[one.path] = reason
        self._found.clear()
