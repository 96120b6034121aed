"""An emulated lidar at a pseudo-terminal."""

from __future__ import annotations

import os
import threading
import time
import tty
from pathlib import Path

from tests.lidar.wires import room

from chefbot.lidar.emulators import LidarEmulator, emulator_of


class PluggedLidar:
    """An emulated lidar at the far end of a pseudo-terminal, that is linked to a path."""

    def __init__(self, driver: str, link: Path) -> None:
        self.lidar: LidarEmulator = emulator_of(driver)
        self._ours, theirs = os.openpty()
        tty.setraw(self._ours)
        tty.setraw(theirs)
        os.set_blocking(self._ours, False)
        self._theirs, self.received = theirs, b""
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(theirs))
        self.silent = False
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        due = time.monotonic()
        while not self._ended.is_set():
            self._answer()
            frame = b"" if self.silent else self.lidar.next_frame(room)
            self._send(frame)
            due = max(due + self.lidar.samples / self.lidar.sample_rate, time.monotonic() - 0.2)
            self._ended.wait(max(0.0, due - time.monotonic()))

    def _send(self, data: bytes) -> None:
        """Send bytes; what nobody reads is lost, as on a line."""
        try:
            os.write(self._ours, data)
        except BlockingIOError:
            return

    def _answer(self) -> None:
        try:
            data = os.read(self._ours, 4096)
        except BlockingIOError:
            return
        self.received += data
        self._send(self.lidar.receive(data))

    def unplug(self) -> None:
        """End, and close both ends."""
        self._ended.set()
        self._thread.join()
        self._answer()
        os.close(self._theirs)
        os.close(self._ours)
