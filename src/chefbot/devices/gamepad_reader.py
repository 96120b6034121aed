"""Reading of a gamepad in a thread: found by what it can do, and found again after it was unplugged."""

from __future__ import annotations

import errno
import os
import select
import threading
from collections.abc import Callable

from chefbot.control.gamepad_teleop import GamepadEvent
from chefbot.devices.input_events import EVENT, EventDecoder, find_gamepads, is_supported, name_of, state_of
from chefbot.errors import UserError

AUTO = "auto"
RETRY_PERIOD = 0.5
"""Pause between two attempts to open the gamepad, s."""


class GamepadReader:
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
        """`device`: a path, or `auto` for the first gamepad. UserError on systems other than Linux."""
        if not is_supported():
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
        path = self._device if self._device != AUTO else next(iter(find_gamepads()), "")
        if not path:
            self._on_missing("no gamepad is plugged in")
            return "", None
        try:
            return path, os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            self._on_missing(explain(path, error))
            return path, None

    def _read(self, path: str, handle: int) -> bool:
        """Read events until the gamepad is gone; return True if the thread must end."""
        state = state_of(handle)
        decoder, connected = EventDecoder(state.ranges), bool(state.ranges)
        if connected:
            self._on_connected(path, name_of(handle))
            self._on_events(decoder.events_of(state))
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
            self._on_events(decoder.decode(data))
            if decoder.lost:
                decoder.lost = False
                self._on_events(decoder.events_of(state_of(handle)))


def explain(path: str, error: OSError) -> str:
    """Explain why a gamepad cannot be read, and what to do."""
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"{path} may not be read; add yourself to its group: sudo usermod -aG input $USER, then log in again"
    return f"{path} cannot be read: {error.strerror}"


def read_some(handle: int) -> bytes | None:
    """Read available bytes: empty when the gamepad is gone, None where nothing is available."""
    try:
        return os.read(handle, 64 * EVENT.size)
    except BlockingIOError:
        return None
    except OSError:
        return b""
