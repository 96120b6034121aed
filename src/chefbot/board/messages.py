"""The board's lines as values: units of the wire, numbers not yet unwrapped (docs/protocol.md)."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import msgspec

from chefbot.board.framing import unframe

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


def _hexadecimal(text: str) -> int:
    return int(text, 16)


UNSIGNED: Field = (r"\d{1,10}", int)
SIGNED: Field = (r"-?\d{1,10}", int)
HEX: Field = (r"[0-9A-F]{2,8}", _hexadecimal)
WORD: Field = (r"[\w.-]{1,32}", str)
SEQUENCE: Field = (r"\d{1,5}", int)

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


class _Form:
    """How the lines of one letter are read."""

    def __init__(self, letter: str, kind: type[BoardLine], fields: tuple[Field, ...]) -> None:
        self._kind = kind
        fields = (SEQUENCE, *fields)
        self._pattern = re.compile(" ".join([letter, *(f"({form})" for form, _ in fields)]), re.ASCII)
        self._readers = [read for _, read in fields]
        counters = [(kind.__struct_fields__.index(n), b) for n, b in _BITS.items() if hasattr(kind, n)]
        self._bounds = [(place, 1 << bits) for place, bits in counters]

    def read(self, text: str) -> BoardLine | None:
        """None where the form is another, or a counter too large.

        Signed counters lie in [-2^(n-1), 2^(n-1)), the others in [0, 2^n); all of them in [-2^n, 2^n).
        """
        found = self._pattern.fullmatch(text)
        if found is None:
            return None
        values = [read(word) for read, word in zip(self._readers, found.groups(), strict=True)]
        if any(abs(values[place]) >= bound for place, bound in self._bounds):
            return None
        return self._kind(*values)


_FORMS = {letter: _Form(letter, *layout) for letter, layout in _LAYOUTS.items()}


def parse(line: bytes) -> BoardLine | None:
    """A line without its LF; None unless the CRC holds and the form is that of its letter."""
    text = unframe(line)
    if text is None:
        return None
    other = _OTHER_VERSION.fullmatch(text) if text.startswith("v") else None
    if other and int(other[3]) != PROTOCOL:
        return OtherVersion(int(other[1]), int(other[2]), int(other[3]))
    form = _FORMS.get(text[:1])
    return None if form is None else form.read(text)
