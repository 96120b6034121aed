"""A Mega with its boot loader at a USB port: each program that opens the port resets the board, as DTR does."""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from pathlib import Path

from chefbot.board.messages import MotionLine, parse
from chefbot.board.status_codes import BoardFlag
from tests.firmware.emulators import MegaWithBootLoader

STEP_US = 10_000
BOOT_US = 1_000_000
"""Time after which the boot loader has ended if it has received nothing."""


class UsbMega:
    """An emulated Mega behind a pseudo-terminal; its time follows the wall clock, or is slower on a slow machine."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.opened = 0
        """How often a program has opened the port."""
        self._emulator = MegaWithBootLoader()
        self._port: int | None = None
        self._since_reset_us = BOOT_US
        self._is_open = False
        self._ending = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.plug()
        self._thread.start()

    def plug(self) -> None:
        """Plug the cable in, which creates a new device file and powers the board."""
        port, terminal = os.openpty()
        tty.setraw(terminal)
        os.set_blocking(port, False)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(terminal))
        os.close(terminal)
        with self._lock:
            self._reset()
            self._port, self._is_open = port, False

    def pull(self) -> None:
        """Pull the cable out, which removes the device file and closes the connection."""
        self.path.unlink()
        with self._lock:
            assert self._port is not None
            os.close(self._port)
            self._port = None

    @property
    def has_session(self) -> bool:
        """Return whether the newest flags that the board has sent show a session."""
        lines = [parse(raw) for raw in self._emulator.sent[-2000:].splitlines()]
        newest = next((line for line in reversed(lines) if isinstance(line, MotionLine)), None)
        return newest is not None and not newest.flags & BoardFlag.NO_SESSION

    def close(self) -> None:
        self._ending.set()
        self._thread.join()
        if self._port is not None:
            self.pull()
        self._emulator.close()

    def __enter__(self) -> UsbMega:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        while not self._ending.is_set():
            due = time.monotonic() + STEP_US * 1e-6
            with self._lock:
                if self._port is not None:
                    self._step(self._port)
            time.sleep(max(0.001, due - time.monotonic()))

    def _step(self, port: int) -> None:
        poll = select.poll()
        poll.register(port, select.POLLIN | select.POLLHUP)
        is_open = not any(event & select.POLLHUP for _, event in poll.poll(0))
        if is_open and not self._is_open:
            self.opened += 1
            self._reset()
        self._is_open = is_open
        self._forward(port)
        self._emulator.set_imu_at_rest()
        sent = self._emulator.run(STEP_US).sent
        self._since_reset_us += STEP_US
        if is_open:
            _write(port, sent)

    def _reset(self) -> None:
        """Reset the board unless its boot loader still runs, as a second reset then makes simavr far slower."""
        if self._since_reset_us >= BOOT_US:
            self._emulator.reset()
            self._since_reset_us = 0

    def _forward(self, port: int) -> None:
        """Forward the bytes from the computer to the board."""
        try:
            data = os.read(port, 4096)
        except OSError:  # no data, or no program that has opened the port
            return
        self._emulator.write(data)


def _write(port: int, data: bytes) -> None:
    try:
        os.write(port, data)
    except BlockingIOError:
        return  # without a reader the rest is lost, as on a serial line
