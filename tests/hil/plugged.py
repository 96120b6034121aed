"""A Mega with its boot loader at a USB socket: each program that opens its port resets it, as DTR does."""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from pathlib import Path

from chefbot.board.messages import MotionLine, parse
from chefbot.board.status_codes import BoardFlag
from tests.firmware.benches import MegaAsSold

STEP_US = 10_000
BOOT_US = 1_000_000
"""By then the boot loader has ended, if nobody speaks to it."""


class PluggedMega:
    """The board's time follows the clock, or is slower where the emulator is."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.opened = 0
        """How often a program has opened the port."""
        self._bench = MegaAsSold()
        self._ours: int | None = None
        self._since_reset_us = BOOT_US
        self._is_open = False
        self._ending = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._live, daemon=True)
        self.plug()
        self._thread.start()

    def plug(self) -> None:
        """A new device file each time, as USB gives one; the board gets its power with it."""
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(theirs))
        os.close(theirs)
        with self._lock:
            self._reset()
            self._ours, self._is_open = ours, False

    def pull(self) -> None:
        """The device file is gone, and whoever had it open learns it."""
        self.path.unlink()
        with self._lock:
            assert self._ours is not None
            os.close(self._ours)
            self._ours = None

    @property
    def has_session(self) -> bool:
        """The newest line that tells the board's flags says so."""
        lines = [parse(raw) for raw in self._bench.said[-2000:].splitlines()]
        newest = next((line for line in reversed(lines) if isinstance(line, MotionLine)), None)
        return newest is not None and not newest.flags & BoardFlag.NO_SESSION

    def close(self) -> None:
        self._ending.set()
        self._thread.join()
        if self._ours is not None:
            self.pull()
        self._bench.close()

    def __enter__(self) -> PluggedMega:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _live(self) -> None:
        while not self._ending.is_set():
            due = time.monotonic() + STEP_US * 1e-6
            with self._lock:
                if self._ours is not None:
                    self._turn(self._ours)
            time.sleep(max(0.001, due - time.monotonic()))

    def _turn(self, ours: int) -> None:
        poll = select.poll()
        poll.register(ours, select.POLLIN | select.POLLHUP)
        is_open = not any(event & select.POLLHUP for _, event in poll.poll(0))
        if is_open and not self._is_open:
            self.opened += 1
            self._reset()
        self._is_open = is_open
        self._down(ours)
        self._bench.live_imu()
        said = self._bench.run(STEP_US).said
        self._since_reset_us += STEP_US
        if is_open:
            _write(ours, said)

    def _reset(self) -> None:
        """Where the boot loader runs still, it would only begin again, and simavr be far slower from then on."""
        if self._since_reset_us >= BOOT_US:
            self._bench.reset()
            self._since_reset_us = 0

    def _down(self, ours: int) -> None:
        try:
            data = os.read(ours, 4096)
        except OSError:  # nothing there, or nobody
            return
        self._bench.write(data)


def _write(ours: int, data: bytes) -> None:
    try:
        os.write(ours, data)
    except BlockingIOError:
        return  # nobody reads: what does not fit is lost, as on a wire
