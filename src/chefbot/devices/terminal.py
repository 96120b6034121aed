"""Keys from a terminal as they are pressed, without Enter and without echo."""

from __future__ import annotations

import atexit
import os
import select
import sys
import threading
from collections.abc import Callable
from contextlib import suppress

from chefbot.errors import UserError

try:
    import termios
    import tty
except ImportError:  # Windows
    termios = None  # type: ignore[assignment]

CC_INDEX = 6
"""Index of the special characters in the result of `termios.tcgetattr`."""


class Terminal:
    """Reads the terminal in its own thread until `close`, which restores its settings.

    They are also restored at the end of the program, whatever ends it. Ctrl-C still interrupts; Ctrl-Z and
    Ctrl-\\ are ordinary keys, as they would leave a terminal without echo behind.
    """

    def __init__(self, on_keys: Callable[[str], None], on_end: Callable[[], None]) -> None:
        """Both callbacks run in the thread; `on_end` is called when the terminal is gone. UserError without a
        terminal."""
        self._on_keys, self._on_end = on_keys, on_end
        self._fd = _handle_of_stdin()
        self._saved_settings = termios.tcgetattr(self._fd)
        self._open = True
        atexit.register(self.close)
        self._set_cbreak()
        self._end_read, self._end_write = os.pipe()
        self._thread = threading.Thread(target=self._read, name="keyboard", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Restore the terminal; a second call does nothing."""
        if not self._open:
            return
        self._open = False
        atexit.unregister(self.close)
        os.write(self._end_write, b".")
        self._thread.join()
        os.close(self._end_read)
        os.close(self._end_write)
        with suppress(termios.error):  # the terminal may be gone, and its settings with it
            termios.tcsetattr(self._fd, termios.TCSADRAIN, self._saved_settings)

    def _set_cbreak(self) -> None:
        tty.setcbreak(self._fd)
        settings = termios.tcgetattr(self._fd)
        for name in (termios.VQUIT, termios.VSUSP):
            settings[CC_INDEX][name] = b"\0"  # no character has this meaning
        termios.tcsetattr(self._fd, termios.TCSADRAIN, settings)

    def _read(self) -> None:
        while True:
            ready, _, _ = select.select([self._fd, self._end_read], [], [])
            if self._end_read in ready:
                return
            data = _read_some(self._fd)
            if not data:
                self._on_end()
                return
            self._on_keys(data.decode(errors="replace"))


def _handle_of_stdin() -> int:
    if termios is None:
        raise UserError(
            "the keyboard is read in terminals of Linux and macOS only; drive with the keys in the robot's web UI"
        )
    if sys.stdin is None or sys.stdin.closed or not sys.stdin.isatty():
        raise UserError(
            "the keyboard needs a terminal, but standard input is not a terminal; start it in a terminal window, "
            "or drive with the keys or the joystick in the robot's web UI"
        )
    return sys.stdin.fileno()


def _read_some(handle: int) -> bytes:
    """Read available bytes; empty when the terminal is gone."""
    try:
        return os.read(handle, 64)
    except OSError:
        return b""
