"""The board's lines as values: units of the wire, numbers not yet unwrapped (docs/protocol.md)."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import msgspec

from chefbot.devices.line.frame import unframe

PROTOCOL = 1
"""The version that this program speaks."""
NO_ECHO, NO_SENSOR = 0, -1
"""`Echo.echo` where nothing was heard, and where no sensor answers."""


class BoardLine(msgspec.Struct, frozen=True):
    """What every line begins with."""

    sequence: int
    """Of the board's lines, modulo 2^16."""


class Measured(BoardLine, frozen=True):
    """A line of one control step."""

    t: int
    """Board's time in us, modulo 2^32."""


class Version(BoardLine, frozen=True):
    """`v`, of a board that speaks our version."""

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


class OtherVersion(BoardLine, frozen=True):
    """`v`, of a board that speaks another version: what follows its number means who knows what."""

    token: int
    protocol: int


class Motion(Measured, frozen=True):
    """`e`: ticks modulo 2^32, angle in 1e-8 rad modulo 2^32, gyro samples in it modulo 2^16."""

    left: int
    right: int
    angle: int
    samples: int
    flags: int


class Inertia(Measured, frozen=True):
    """`i`: 1e-6 rad/s, mm/s^2, 0.01 degC, in the axes of the chip."""

    gx: int
    gy: int
    gz: int
    ax: int
    ay: int
    az: int
    temperature: int
    bias_z: int


class Status(Measured, frozen=True):
    """`s`: speeds in force in ticks/s, duty of `duty_full`, what was refused and why."""

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


class Echo(Measured, frozen=True):
    """`u`: us of the round trip, NO_ECHO or NO_SENSOR."""

    echo: int


class Battery(Measured, frozen=True):
    """`b`: mV."""

    millivolts: int


class Uptime(Measured, frozen=True):
    """`t`: s since power-on, lines without room, control steps missed."""

    uptime: int
    dropped: int
    missed: int


Field = tuple[str, Callable[[str], Any]]


def _integer(text: str) -> int:
    return int(text)


def _hexadecimal(text: str) -> int:
    return int(text, 16)


UNSIGNED: Field = (r"\d{1,10}", _integer)
SIGNED: Field = (r"-?\d{1,10}", _integer)
HEX: Field = (r"[0-9A-F]{2,8}", _hexadecimal)
WORD: Field = (r"[\w.-]{1,32}", str)

_LAYOUTS: dict[str, tuple[type[BoardLine], tuple[Field, ...]]] = {
    "e": (Motion, (UNSIGNED, SIGNED, SIGNED, SIGNED, UNSIGNED, HEX)),
    "i": (Inertia, (UNSIGNED, *(SIGNED,) * 8)),
    "s": (Status, (UNSIGNED, UNSIGNED, HEX, UNSIGNED, *(SIGNED,) * 4, *(UNSIGNED,) * 4)),
    "u": (Echo, (UNSIGNED, SIGNED)),
    "b": (Battery, (UNSIGNED, UNSIGNED)),
    "t": (Uptime, (UNSIGNED,) * 4),
    "v": (Version, (SIGNED, WORD, UNSIGNED, WORD, HEX, *(UNSIGNED,) * 8, HEX)),
}
_BITS = {"sequence": 16, "t": 32, "samples": 16, "refused": 16, "left": 32, "right": 32, "angle": 32}
"""Of counters: what is larger was not sent by a board."""
_OTHER_VERSION = re.compile(r"v (\d{1,5}) (-?\d{1,10}) chefbot (\d{1,5})(?: .*)?", re.ASCII)


def parse(line: bytes) -> BoardLine | None:
    """A line without its LF; None unless the CRC holds and the form is that of its letter."""
    text = unframe(line)
    return None if text is None else _parse_text(text)


def _parse_text(text: str) -> BoardLine | None:
    other = _OTHER_VERSION.fullmatch(text)
    if other and int(other[3]) != PROTOCOL:
        return OtherVersion(int(other[1]), int(other[2]), int(other[3]))
    layout = _LAYOUTS.get(text[:1])
    found = layout and _PATTERNS[text[0]].fullmatch(text)
    if not layout or not found:
        return None
    kind, fields = layout
    readers = (_integer, *(read for _, read in fields))
    made = kind(*(read(word) for read, word in zip(readers, found.groups(), strict=True)))
    return made if _fits(made) else None


def _pattern(letter: str, fields: tuple[Field, ...]) -> re.Pattern[str]:
    words = "".join(f" ({form})" for form, _ in fields)
    return re.compile(rf"{letter} (\d{{1,5}}){words}", re.ASCII)


def _fits(line: BoardLine) -> bool:
    """Signed counters lie in [-2^(n-1), 2^(n-1)), the others in [0, 2^n); all of them in [-2^n, 2^n)."""
    return all(abs(getattr(line, name, 0)) < 1 << bits for name, bits in _BITS.items())


_PATTERNS = {letter: _pattern(letter, fields) for letter, (_, fields) in _LAYOUTS.items()}
