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

CHARACTERS = 6
"""Where `termios.tcgetattr` keeps the characters with a meaning."""


class Terminal:
    """Reads the terminal in a thread of its own until `close`, which gives it back as it was.

    It is also given back at the end of the program, however that comes about. Ctrl-C still interrupts;
    Ctrl-Z and Ctrl-\\ are keys like others, for they would leave a terminal without echo behind.
    """

    def __init__(self, on_keys: Callable[[str], None], on_end: Callable[[], None]) -> None:
        """Both are called in the thread; `on_end` when the terminal is gone. UserError if there is none."""
        self._on_keys, self._on_end = on_keys, on_end
        self._handle = _handle_of_stdin()
        self._before = termios.tcgetattr(self._handle)
        self._open = True
        atexit.register(self.close)
        self._watch_keys()
        self._ended, self._end = os.pipe()
        self._thread = threading.Thread(target=self._read, name="keyboard", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Give the terminal back; a second time does nothing."""
        if not self._open:
            return
        self._open = False
        atexit.unregister(self.close)
        os.write(self._end, b".")
        self._thread.join()
        os.close(self._ended)
        os.close(self._end)
        with suppress(termios.error):  # the terminal may be gone, and its settings with it
            termios.tcsetattr(self._handle, termios.TCSADRAIN, self._before)

    def _watch_keys(self) -> None:
        tty.setcbreak(self._handle)
        settings = termios.tcgetattr(self._handle)
        for name in (termios.VQUIT, termios.VSUSP):
            settings[CHARACTERS][name] = b"\0"  # no character has this meaning
        termios.tcsetattr(self._handle, termios.TCSADRAIN, settings)

    def _read(self) -> None:
        while True:
            ready, _, _ = select.select([self._handle, self._ended], [], [])
            if self._ended in ready:
                return
            data = _read_some(self._handle)
            if not data:
                self._on_end()
                return
            self._on_keys(data.decode(errors="replace"))


def _handle_of_stdin() -> int:
    if termios is None:
        raise UserError(
            "the keyboard is read in terminals of Linux and macOS only; drive with the keys on the robot's page"
        )
    if sys.stdin is None or sys.stdin.closed or not sys.stdin.isatty():
        raise UserError(
            "the keyboard needs a terminal, but the standard input is none; start it in a terminal window, "
            "or drive with the keys or the joystick on the robot's page"
        )
    return sys.stdin.fileno()


def _read_some(handle: int) -> bytes:
    """Nothing when the terminal is gone."""
    try:
        return os.read(handle, 64)
    except OSError:
        return b""
