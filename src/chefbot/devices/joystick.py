"""Linux joystick interface: events of 8 bytes from /dev/input/js0 (kernel,
Documentation/input/joydev/joystick-api.rst)."""

from __future__ import annotations

import errno
import os
import select
import struct
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from chefbot.control.gamepad_teleop import GamepadEvent
from chefbot.errors import UserError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

EVENT = struct.Struct("=IhBB")
"""struct js_event: time in ms, value, type, number."""
BUTTON, AXIS, INIT = 0x01, 0x02, 0x80
"""Event types of <linux/joystick.h>; INIT marks the initial state."""
AXIS_MAX = 32767
"""Maximum of an axis value."""
JSIOCGNAME = 0x80006A13 + (128 << 16)
"""ioctl request JSIOCGNAME(128) of <linux/joystick.h>."""
AUTO = "auto"
FOLDER = Path("/dev/input")
RETRY_PERIOD = 0.5
"""Pause between two attempts to open the gamepad, s."""


def decode(data: bytes) -> tuple[list[GamepadEvent], bytes]:
    """Decode complete events and return them with the remaining bytes; unknown types are skipped."""
    complete_size = len(data) - len(data) % EVENT.size
    events = []
    for _, value, kind, number in EVENT.iter_unpack(data[:complete_size]):
        is_initial, kind = bool(kind & INIT), kind & ~INIT
        if kind == BUTTON:
            events.append(GamepadEvent("button", number, float(value != 0), is_initial))
        elif kind == AXIS:
            events.append(GamepadEvent("axis", number, max(-1.0, value / AXIS_MAX), is_initial))
    return events, data[complete_size:]


class Joystick:
    """Reads one gamepad in its own thread until `close`, and reconnects after it was unplugged.

    It calls back in its thread: `on_connected(path, name)` before the first events, `on_events`,
    `on_disconnected(reason)`, and `on_missing(reason)` whenever it cannot be opened.
    """

    def __init__(
        self,
        device: str,
        on_connected: Callable[[str, str], None],
        on_events: Callable[[list[GamepadEvent]], None],
        on_disconnected: Callable[[str], None],
        on_missing: Callable[[str], None],
    ) -> None:
        """`device`: a path, or `auto` for the first of /dev/input/js*. UserError on systems other than Linux."""
        if fcntl is None or sys.platform != "linux":
            raise UserError(
                "gamepads are read on Linux only; drive with a gamepad, keys or the joystick in the web UI"
            )
        self._device = device
        self._on_connected, self._on_events = on_connected, on_events
        self._on_disconnected, self._on_missing = on_disconnected, on_missing
        self._end_read, self._end_write = os.pipe()
        self._thread = threading.Thread(target=self._run, name="gamepad", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and wait for it."""
        os.write(self._end_write, b".")
        self._thread.join()
        os.close(self._end_read)
        os.close(self._end_write)

    # -- in the thread

    def _run(self) -> None:
        closing = False
        while not closing:
            path, handle = self._open()
            if handle is not None:
                closing = self._read(path, handle)
                os.close(handle)
            closing = closing or bool(select.select([self._end_read], [], [], RETRY_PERIOD)[0])

    def _open(self) -> tuple[str, int | None]:
        path = self._device if self._device != AUTO else first_pad()
        if not path:
            self._on_missing(f"no gamepad is plugged in: there is no {FOLDER}/js*")
            return "", None
        try:
            return path, os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            self._on_missing(explain(path, error))
            return path, None

    def _read(self, path: str, handle: int) -> bool:
        """Read events until the gamepad is gone; return True if the thread must end."""
        remaining, connected = b"", False
        while True:
            ready, _, _ = select.select([handle, self._end_read], [], [])
            if self._end_read in ready:
                return True
            data = read_some(handle)
            if data is None:
                continue
            if not data:
                if connected:
                    self._on_disconnected(f"the gamepad at {path} is gone")
                return False
            if not connected:
                connected = True
                self._on_connected(path, name_of(handle))
            events, remaining = decode(remaining + data)
            self._on_events(events)


def first_pad() -> str:
    """Return the path of the joystick with the smallest number; empty where there is none."""
    paths = [path for path in FOLDER.glob("js*") if path.name[2:].isdigit()]
    return str(min(paths, key=lambda path: int(path.name[2:]))) if paths else ""


def explain(path: str, error: OSError) -> str:
    """Explain why a gamepad cannot be read, and what to do."""
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"{path} may not be read; add yourself to its group: sudo usermod -aG input $USER, then log in again"
    return f"{path} cannot be read: {error.strerror}"


def name_of(handle: int) -> str:
    """Return the gamepad's name; empty where the kernel has none, as for a pipe."""
    buffer = bytearray(128)
    try:
        fcntl.ioctl(handle, JSIOCGNAME, buffer)
    except OSError:
        return ""
    return buffer.split(b"\0", 1)[0].decode(errors="replace")


def read_some(handle: int) -> bytes | None:
    """Read available bytes: empty when the gamepad is gone, None where nothing is available."""
    try:
        return os.read(handle, 64 * EVENT.size)
    except BlockingIOError:
        return None
    except OSError:
        return b""
