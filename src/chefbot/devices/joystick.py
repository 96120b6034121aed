"""Linux's joysticks: events of 8 bytes from /dev/input/js0 (kernel, Documentation/input/joydev/joystick-api.rst)."""

from __future__ import annotations

import errno
import os
import select
import struct
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from chefbot.control.gamepad_teleop import PadEvent
from chefbot.errors import UserError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

EVENT = struct.Struct("=IhBB")
"""struct js_event: time in ms, value, type, number."""
BUTTON, AXIS, INIT = 0x01, 0x02, 0x80
FULL = 32767
NAME = 0x80006A13 + (128 << 16)
"""JSIOCGNAME(128) of <linux/joystick.h>."""
AUTO = "auto"
FOLDER = Path("/dev/input")
LOOK_AGAIN = 0.5
"""Seconds between two looks for a pad that is not there."""


def decode(data: bytes) -> tuple[list[PadEvent], bytes]:
    """Whole events, and what is left of one; types that nobody knows are skipped."""
    end = len(data) - len(data) % EVENT.size
    events = []
    for _, value, kind, number in EVENT.iter_unpack(data[:end]):
        initial, kind = bool(kind & INIT), kind & ~INIT
        if kind == BUTTON:
            events.append(PadEvent("button", number, float(value != 0), initial))
        elif kind == AXIS:
            events.append(PadEvent("axis", number, max(-1.0, value / FULL), initial))
    return events, data[end:]


class Joystick:
    """Reads one pad in a thread of its own until `close`; finds it again when it was unplugged.

    Calls back in its thread: `on_there(path, name)` before the first events, `on_events`, `on_gone(why)`, and
    `on_missing(why)` whenever it was looked for in vain.
    """

    def __init__(
        self,
        wanted: str,
        on_there: Callable[[str, str], None],
        on_events: Callable[[list[PadEvent]], None],
        on_gone: Callable[[str], None],
        on_missing: Callable[[str], None],
    ) -> None:
        """`wanted`: a path, or `auto` for the first of /dev/input/js*. UserError on another system than Linux."""
        if fcntl is None or sys.platform != "linux":
            raise UserError(
                "gamepads are read on Linux only; drive with a gamepad, keys or the joystick on the robot's page"
            )
        self._wanted = wanted
        self._on_there, self._on_events, self._on_gone, self._on_missing = (
            on_there,
            on_events,
            on_gone,
            on_missing,
        )
        self._ended, self._end = os.pipe()
        self._thread = threading.Thread(target=self._run, name="gamepad", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        os.write(self._end, b".")
        self._thread.join()
        os.close(self._ended)
        os.close(self._end)

    # -- in the thread

    def _run(self) -> None:
        ending = False
        while not ending:
            path, handle = self._open()
            if handle is not None:
                ending = self._read(path, handle)
                os.close(handle)
            ending = ending or bool(select.select([self._ended], [], [], LOOK_AGAIN)[0])

    def _open(self) -> tuple[str, int | None]:
        path = self._wanted if self._wanted != AUTO else first_pad()
        if not path:
            self._on_missing(f"no gamepad is plugged in: there is no {FOLDER}/js*")
            return "", None
        try:
            return path, os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            self._on_missing(explain(path, error))
            return path, None

    def _read(self, path: str, handle: int) -> bool:
        """Until it is gone, or until it is to end: then True."""
        rest, there = b"", False
        while True:
            ready, _, _ = select.select([handle, self._ended], [], [])
            if self._ended in ready:
                return True
            data = read_some(handle)
            if data is None:
                continue
            if not data:
                if there:
                    self._on_gone(f"the gamepad at {path} is gone")
                return False
            if not there:
                there = True
                self._on_there(path, name_of(handle))
            events, rest = decode(rest + data)
            self._on_events(events)


def first_pad() -> str:
    """The path of the joystick with the smallest number; empty where there is none."""
    found = [path for path in FOLDER.glob("js*") if path.name[2:].isdigit()]
    return str(min(found, key=lambda path: int(path.name[2:]))) if found else ""


def explain(path: str, error: OSError) -> str:
    """Why a pad cannot be read, and what to do."""
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"{path} may not be read; add yourself to its group: sudo usermod -aG input $USER, then log in again"
    return f"{path} cannot be read: {error.strerror}"


def name_of(handle: int) -> str:
    """What the pad calls itself; empty where the kernel does not tell, as of a pipe."""
    buffer = bytearray(128)
    try:
        fcntl.ioctl(handle, NAME, buffer)
    except OSError:
        return ""
    return buffer.split(b"\0", 1)[0].decode(errors="replace")


def read_some(handle: int) -> bytes | None:
    """Empty when the pad is gone, None where nothing is there after all."""
    try:
        return os.read(handle, 64 * EVENT.size)
    except BlockingIOError:
        return None
    except OSError:
        return b""
