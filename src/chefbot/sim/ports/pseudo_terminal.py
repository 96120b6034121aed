"""The far end of a serial cable to a program: a pseudo-terminal that is linked at a path."""

from __future__ import annotations

import os
import select
from pathlib import Path

CHUNK = 4096


class PseudoTerminal:
    """A serial port of this computer, seen from the device that is plugged in there."""

    def __init__(self, link: Path) -> None:
        """Create the port and link it at a path, instead of a dangling link. Raises OSError if something is there."""
        import tty  # missing on Windows

        self.link = link
        if link.is_symlink() and not link.exists():
            link.unlink()
        self._port, terminal = os.openpty()
        tty.setraw(terminal)
        os.set_blocking(self._port, False)
        link.symlink_to(os.ttyname(terminal))
        os.close(terminal)
        self._was_open = False

    def take_opening(self) -> bool:
        """Return whether a program has opened the port since the last call; an adapter raises DTR then."""
        poll = select.poll()
        poll.register(self._port, select.POLLIN | select.POLLHUP)
        is_open = not any(event & select.POLLHUP for _, event in poll.poll(0))
        was_open, self._was_open = self._was_open, is_open
        return is_open and not was_open

    @property
    def is_open(self) -> bool:
        """Whether a program had the port open at the last `take_opening`."""
        return self._was_open

    def read(self) -> bytes:
        """Return what the program has written, b"" for nothing."""
        try:
            return os.read(self._port, CHUNK)
        except OSError:  # no data, or no program that has opened the port
            return b""

    def write(self, data: bytes) -> None:
        """Send bytes; what no program reads is lost, as on a serial line."""
        if not self._was_open or not data:
            return
        try:
            os.write(self._port, data)
        except BlockingIOError:
            return

    def close(self) -> None:
        """Close the port and remove its link, as an unplugged device does."""
        self.link.unlink(missing_ok=True)
        os.close(self._port)
