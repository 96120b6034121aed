"""The protocol of the book chapter's firmware: TAB-separated fields without CRC or sequence number
(docs/protocol.md)."""

from __future__ import annotations

import re

import msgspec

from chefbot.board.framing import LineSplitter

DUTY_FULL = 255
"""Full duty cycle of its motors: Energia's analogWrite has 8 bits."""
EDGES_PER_TICK = 4
"""Edges per counted tick: it counts rising edges of one channel; a tick of the robot file is any edge of
both."""


class ChapterLine(msgspec.Struct, frozen=True):
    """A well-formed line; without a checksum it may still be damaged."""


class ChapterTime(ChapterLine, frozen=True):
    """Line `t`: the board's time in us, modulo 2^32."""

    t: int


class ChapterTicks(ChapterLine, frozen=True):
    """Line `e`: rising edges of one encoder channel per wheel, signed 32 bits."""

    left: int
    right: int


class ChapterEcho(ChapterLine, frozen=True):
    """Line `u`: ultrasonic distance in whole cm, 0 without an echo."""

    centimetres: int


class ChapterAttitude(ChapterLine, frozen=True):
    """Line `i`: attitude as a quaternion with two decimals."""

    x: float
    y: float
    z: float
    w: float


class ChapterBattery(ChapterLine, frozen=True):
    """Line `b`: raw ADC value of the battery; the ratio of its voltage divider is unknown here."""

    raw: int


_SIGNED, _UNSIGNED, _DECIMAL = r"-?\d{1,10}", r"\d{1,10}", r"-?\d{1,6}\.\d\d"
_LAYOUTS: dict[str, tuple[str, type[ChapterLine]]] = {
    "t": (rf"({_UNSIGNED})\t{_DECIMAL}", ChapterTime),
    "e": (rf"({_SIGNED})\t({_SIGNED})", ChapterTicks),
    "u": (rf"({_UNSIGNED})", ChapterEcho),
    "s": (rf"{_DECIMAL}\t{_DECIMAL}", ChapterLine),
    "i": (rf"({_DECIMAL})\t({_DECIMAL})\t({_DECIMAL})\t({_DECIMAL})", ChapterAttitude),
    "b": (rf"({_UNSIGNED})", ChapterBattery),
}
_PATTERNS = {
    letter.encode(): (re.compile(rf"{letter}\t{pattern}".encode()), kind)
    for letter, (pattern, kind) in _LAYOUTS.items()
}


def parse_chapter(line: bytes) -> ChapterLine | None:
    """Parse a line without its LF; return None for boot messages and other malformed lines."""
    pattern, kind = _PATTERNS.get(line[:1], (None, ChapterLine))
    match = pattern and pattern.fullmatch(line)
    return kind(*map(_number, match.groups())) if match else None


def duty_line(left: int, right: int) -> bytes:
    """Return the command line `s LEFT RIGHT` and CR, with duties of -DUTY_FULL..DUTY_FULL."""
    return b"s %d %d\r" % (left, right)


def _number(text: bytes) -> int | float:
    return float(text) if b"." in text else int(text)


class ChapterReader:
    """Splits a byte stream into lines of the chapter's protocol and parses them."""

    def __init__(self) -> None:
        self._splitter = LineSplitter()
        self.malformed = 0
        """Number of malformed lines received so far."""

    def read(self, data: bytes) -> list[ChapterLine]:
        """Return the well-formed lines that are completed by `data`."""
        lines = [parse_chapter(raw) for raw in self._splitter.push(data)]
        self.malformed += lines.count(None)
        return [line for line in lines if line is not None]

    def clear(self) -> None:
        """Discard the partly received line."""
        self._splitter.clear()
