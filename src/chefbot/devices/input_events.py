"""Input events of Linux (evdev): buttons and axes of a gamepad by their meaning, which no driver changes.

Codes are those of <linux/input-event-codes.h>, meanings those of the kernel's gamepad specification
(Documentation/input/gamepad.rst).
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple

from chefbot.control.gamepad_teleop import GamepadEvent

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

EVENT = struct.Struct("@llHHi")
"""struct input_event: seconds, microseconds, type, code, value."""
SYN, KEY, ABS = 0x00, 0x01, 0x03
"""Event types: synchronization, button, axis."""
SYN_REPORT, SYN_DROPPED = 0, 3
"""Codes of synchronization: end of a report; events were lost because they were not read in time."""
BUTTONS = {
    0x130: "south",
    0x131: "east",
    0x133: "north",
    0x134: "west",
    0x136: "left_shoulder",
    0x137: "right_shoulder",
    0x138: "left_trigger",
    0x139: "right_trigger",
    0x13A: "select",
    0x13B: "start",
    0x13C: "mode",
}
GAMEPAD_BUTTON = 0x130
"""Code that marks a device as a gamepad (BTN_GAMEPAD)."""
AXES = {0x00: "left_x", 0x01: "left_y", 0x03: "right_x", 0x04: "right_y", 0x10: "dpad_x", 0x11: "dpad_y"}
RIGHT_STICK, OTHER_RIGHT_STICK = (0x03, 0x04), {0x02: "right_x", 0x05: "right_y"}
"""Axes of the right stick; gamepads without them report it as Z and RZ."""
DPAD_BUTTONS = {
    0x220: ("dpad_y", -1.0),
    0x221: ("dpad_y", 1.0),
    0x222: ("dpad_x", -1.0),
    0x223: ("dpad_x", 1.0),
}
"""Buttons of the directional pad, as positions of an axis."""
AXIS_COUNT, KEY_BYTES = 0x40, 0x300 // 8
ABSINFO = struct.Struct("=6i")
"""struct input_absinfo: value, minimum, maximum, fuzz, flat, resolution."""
NAME_LENGTH = 128
LONG_BITS = 8 * struct.calcsize("l")
INPUT_CLASS = Path("/sys/class/input")


class AxisRange(NamedTuple):
    """The range of an axis, and the half width of its centre where it counts as released."""

    minimum: int = -32768
    maximum: int = 32767
    flat: int = 0

    def position(self, value: int) -> float:
        """Return a value as a position from -1 to 1, 0 in the centre."""
        centre, half = (self.minimum + self.maximum) / 2.0, (self.maximum - self.minimum) / 2.0
        offset = value - centre
        # the centre of -32768 to 32767 lies between two values
        if half <= 0.0 or abs(offset) <= max(self.flat, 0.5):
            return 0.0
        return max(-1.0, min(1.0, offset / half))


class DeviceState(NamedTuple):
    """What is pressed, the value of each axis, and its range; empty for a file that is not an input device."""

    pressed: frozenset[int]
    values: dict[int, int]
    ranges: dict[int, AxisRange]


class EventDecoder:
    """Decodes the bytes of one device; `lost` is true after a report was lost, until the state is read again."""

    def __init__(self, ranges: dict[int, AxisRange]) -> None:
        self._ranges, self._axes = ranges, axis_names(ranges)
        self._rest, self._skipping = b"", False
        self.lost = False

    def decode(self, data: bytes) -> list[GamepadEvent]:
        """Return the events of all complete records; those of an incomplete report are left out."""
        data = self._rest + data
        complete = len(data) - len(data) % EVENT.size
        self._rest = data[complete:]
        events = list[GamepadEvent]()
        for _, _, kind, code, value in EVENT.iter_unpack(data[:complete]):
            if kind == SYN:
                self._synchronize(code)
            elif not self._skipping:
                events += self._event(kind, code, value)
        return events

    def events_of(self, state: DeviceState) -> list[GamepadEvent]:
        """Return the state of a device as initial events: released buttons, too."""
        events = [
            GamepadEvent("button", name, float(code in state.pressed), True) for code, name in BUTTONS.items()
        ]
        for code, value in state.values.items():
            events += [event._replace(initial=True) for event in self._event(ABS, code, value)]
        return events if state.ranges or state.pressed else []

    def _synchronize(self, code: int) -> None:
        # After SYN_DROPPED everything up to the next report belongs to a state that is not complete
        if code == SYN_DROPPED:
            self._skipping = True
        elif code == SYN_REPORT and self._skipping:
            self._skipping, self.lost = False, True

    def _event(self, kind: int, code: int, value: int) -> Iterator[GamepadEvent]:
        if kind == ABS:
            name = self._axes.get(code, str(code))
            yield GamepadEvent("axis", name, self._ranges.get(code, AxisRange()).position(value))
        elif kind == KEY and code in DPAD_BUTTONS:
            name, position = DPAD_BUTTONS[code]
            yield GamepadEvent("axis", name, position if value else 0.0)
        elif kind == KEY:
            yield GamepadEvent("button", BUTTONS.get(code, str(code)), float(value != 0))


def is_supported() -> bool:
    """Return whether this system has input devices of this kind."""
    return fcntl is not None and sys.platform == "linux"


def axis_names(axes: Collection[int]) -> dict[int, str]:
    """Return the names of a gamepad's axes by their codes."""
    has_right_stick = not axes or any(code in axes for code in RIGHT_STICK)
    return AXES if has_right_stick else AXES | OTHER_RIGHT_STICK


def find_gamepads(folder: Path = INPUT_CLASS) -> list[str]:
    """Return the device files of the connected gamepads, the oldest first; what they can do is readable by all."""
    found = []
    for path in folder.glob("event*"):
        try:
            longs = (path / "device" / "capabilities" / "key").read_text().split()
        except OSError:
            continue  # unplugged since
        bits = sum(int(word, 16) << LONG_BITS * i for i, word in enumerate(reversed(longs)))
        if path.name[5:].isdigit() and bits >> GAMEPAD_BUTTON & 1:
            found.append(int(path.name[5:]))
    return [f"/dev/input/event{number}" for number in sorted(found)]


def name_of(handle: int) -> str:
    """Return the name of an input device; empty of another file, as a pipe."""
    return _ioctl(handle, 0x06, NAME_LENGTH).split(b"\0", 1)[0].decode(errors="replace")


def state_of(handle: int) -> DeviceState:
    """Return the state of an input device."""
    pressed = _bits(_ioctl(handle, 0x18, KEY_BYTES))
    values, ranges = {}, {}
    for code in _bits(_ioctl(handle, 0x20 + ABS, AXIS_COUNT // 8)):
        info = _ioctl(handle, 0x40 + code, ABSINFO.size)
        if info:
            values[code], minimum, maximum, _, flat, _ = ABSINFO.unpack(info)
            ranges[code] = AxisRange(minimum, maximum, flat)
    return DeviceState(pressed, values, ranges)


def _bits(data: bytes) -> frozenset[int]:
    number = int.from_bytes(data, "little")
    return frozenset(i for i in range(8 * len(data)) if number >> i & 1)


def _ioctl(handle: int, number: int, size: int) -> bytes:
    """Return what the kernel answers to a read request of type 'E' (EVIOCG...); empty if it refuses."""
    buffer = bytearray(size)
    try:
        fcntl.ioctl(handle, 2 << 30 | size << 16 | ord("E") << 8 | number, buffer)
    except OSError:
        return b""
    return bytes(buffer)
