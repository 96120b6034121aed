"""The board's lines as values, in the units of the serial protocol, with wrapping counters
(docs/protocol.md)."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import msgspec

from chefbot.board.framing import unframe

PROTOCOL = 1
"""Protocol version of this program."""
NO_ECHO, NO_SENSOR = 0, -1
"""Values of `Echo.echo` when no echo was received and when no sensor answers."""


class BoardLine(msgspec.Struct, frozen=True):
    """Base of all lines from the board."""

    sequence: int
    """Sequence number of the board's lines, modulo 2^16."""


class TimedLine(BoardLine, frozen=True):
    """A line with data of one control step."""

    t: int
    """The board's time, us, modulo 2^32."""


class VersionLine(BoardLine, frozen=True):
    """Line `v`: handshake answer of a board with our protocol version."""

    token: int
    name: str
    protocol: int
    port: str
    hash: int
    ticks_per_turn_milli: int
    control_rate: int
    duty_full: int
    max_wheel: int
    max_forward: int
    max_turn: int
    acceleration: int
    first: int
    sensors: int


class UnsupportedVersionLine(BoardLine, frozen=True):
    """Line `v` of a board with another protocol version: the meaning of its other fields is unknown."""

    token: int
    protocol: int


class MotionLine(TimedLine, frozen=True):
    """Line `e`: ticks modulo 2^32, integrated angle in 1e-8 rad modulo 2^32, number of gyro samples in it
    modulo 2^16."""

    left: int
    right: int
    angle: int
    samples: int
    flags: int


class InertiaLine(TimedLine, frozen=True):
    """Line `i`: angular rates in 1e-6 rad/s, accelerations in mm/s^2, temperature in 0.01 degC, in the axes
    of the chip."""

    gx: int
    gy: int
    gz: int
    ax: int
    ay: int
    az: int
    temperature: int
    bias_z: int


class StatusLine(TimedLine, frozen=True):
    """Line `s`: speeds in force in ticks/s, duty cycles in units of 1/`duty_full`, number of refused lines
    and the last reason."""

    state: int
    flags: int
    obeyed: int
    set_left: int
    set_right: int
    duty_left: int
    duty_right: int
    refused: int
    reason: int
    illegal_left: int
    illegal_right: int


class EchoLine(TimedLine, frozen=True):
    """Line `u`: round-trip time of the ultrasonic echo, us, or NO_ECHO or NO_SENSOR."""

    echo: int


class CliffLine(TimedLine, frozen=True):
    """Line `d`: bit i is set if cliff sensor i sees no floor."""

    cliffs: int


class BatteryLine(TimedLine, frozen=True):
    """Line `b`: voltage of the battery, mV."""

    millivolts: int


class UptimeLine(TimedLine, frozen=True):
    """Line `t`: seconds since power-on, lines dropped for lack of buffer space, missed control steps, IMU.

    imu: WHO_AM_I of the IMU's chip, 0 if none answers.
    """

    uptime: int
    dropped: int
    missed: int
    imu: int


Field = tuple[str, Callable[[str], Any]]


def _hexadecimal(text: str) -> int:
    return int(text, 16)


UNSIGNED: Field = (r"\d{1,10}", int)
SIGNED: Field = (r"-?\d{1,10}", int)
HEX: Field = (r"[0-9A-F]{2,8}", _hexadecimal)
WORD: Field = (r"[\w.-]{1,32}", str)
SEQUENCE: Field = (r"\d{1,5}", int)

_LAYOUTS: dict[str, tuple[type[BoardLine], tuple[Field, ...]]] = {
    "e": (MotionLine, (UNSIGNED, SIGNED, SIGNED, SIGNED, UNSIGNED, HEX)),
    "i": (InertiaLine, (UNSIGNED, *(SIGNED,) * 8)),
    "s": (StatusLine, (UNSIGNED, UNSIGNED, HEX, UNSIGNED, *(SIGNED,) * 4, *(UNSIGNED,) * 4)),
    "u": (EchoLine, (UNSIGNED, SIGNED)),
    "d": (CliffLine, (UNSIGNED, HEX)),
    "b": (BatteryLine, (UNSIGNED, UNSIGNED)),
    "t": (UptimeLine, (*(UNSIGNED,) * 4, HEX)),
    "v": (VersionLine, (SIGNED, WORD, UNSIGNED, WORD, HEX, *(UNSIGNED,) * 8, HEX)),
}
_BITS = {"sequence": 16, "t": 32, "samples": 16, "refused": 16, "left": 32, "right": 32, "angle": 32}
"""Width of the counters in bits: a larger value was not sent by a board."""
_OTHER_VERSION = re.compile(r"v (\d{1,5}) (-?\d{1,10}) chefbot (\d{1,5})(?: .*)?", re.ASCII)


class _LineParser:
    """Parser for the lines of one letter."""

    def __init__(self, letter: str, kind: type[BoardLine], fields: tuple[Field, ...]) -> None:
        self._kind = kind
        fields = (SEQUENCE, *fields)
        self._pattern = re.compile(" ".join([letter, *(f"({pattern})" for pattern, _ in fields)]), re.ASCII)
        self._readers = [read for _, read in fields]
        counters = [(kind.__struct_fields__.index(n), b) for n, b in _BITS.items() if hasattr(kind, n)]
        self._bounds = [(index, 1 << bits) for index, bits in counters]

    def read(self, text: str) -> BoardLine | None:
        """Return the parsed line; None if the format differs or a counter is out of range.

        Signed counters lie in [-2^(n-1), 2^(n-1)), the others in [0, 2^n); all of them in [-2^n, 2^n).
        """
        match = self._pattern.fullmatch(text)
        if match is None:
            return None
        values = [read(text_field) for read, text_field in zip(self._readers, match.groups(), strict=True)]
        # Reject values that do not fit into the board's counters.
        for index, bound in self._bounds:
            if not -bound < values[index] < bound:
                return None
        return self._kind(*values)


_PARSERS = {letter: _LineParser(letter, *layout) for letter, layout in _LAYOUTS.items()}


def parse(line: bytes) -> BoardLine | None:
    """Parse a line without its LF; return None unless the checksum is valid and the format is that of its
    letter."""
    text = unframe(line)
    if text is None:
        return None
    # The fields of another version's handshake are not parsed beyond its number.
    other = _OTHER_VERSION.fullmatch(text) if text.startswith("v") else None
    if other and int(other[3]) != PROTOCOL:
        return UnsupportedVersionLine(int(other[1]), int(other[2]), int(other[3]))
    parser = _PARSERS.get(text[:1])
    return None if parser is None else parser.read(text)
