"""The chapter's own dialect: lines of TAB-separated fields without CRC or number (docs/protocol.md)."""

from __future__ import annotations

import re

import msgspec

from chefbot.board.framing import LineSplitter

DUTY_FULL = 255
"""Its motors get no more whatever is asked for: Energia's analogWrite has 8 bits."""
EDGES = 4
"""It counts rising edges of one channel; a tick of the robot file is any edge of both."""


class ChapterLine(msgspec.Struct, frozen=True):
    """A well-formed line; nothing says that it is undamaged."""


class ChapterTime(ChapterLine, frozen=True):
    """`t`: us, modulo 2^32."""

    t: int


class ChapterTicks(ChapterLine, frozen=True):
    """`e`: rising edges of one channel, signed, 32 bits."""

    left: int
    right: int


class ChapterEcho(ChapterLine, frozen=True):
    """`u`: whole cm, 0 without echo."""

    centimetres: int


class ChapterAttitude(ChapterLine, frozen=True):
    """`i`: quaternion with two decimals."""

    x: float
    y: float
    z: float
    w: float


class ChapterBattery(ChapterLine, frozen=True):
    """`b`: what the converter reads; the divider before it is not known here."""

    raw: int


_SIGNED, _UNSIGNED, _DECIMAL = r"-?\d{1,10}", r"\d{1,10}", r"-?\d{1,6}\.\d\d"
_FORMS: dict[str, tuple[str, type[ChapterLine]]] = {
    "t": (rf"({_UNSIGNED})\t{_DECIMAL}", ChapterTime),
    "e": (rf"({_SIGNED})\t({_SIGNED})", ChapterTicks),
    "u": (rf"({_UNSIGNED})", ChapterEcho),
    "s": (rf"{_DECIMAL}\t{_DECIMAL}", ChapterLine),
    "i": (rf"({_DECIMAL})\t({_DECIMAL})\t({_DECIMAL})\t({_DECIMAL})", ChapterAttitude),
    "b": (rf"({_UNSIGNED})", ChapterBattery),
}
_PATTERNS = {
    letter.encode(): (re.compile(rf"{letter}\t{form}".encode()), kind)
    for letter, (form, kind) in _FORMS.items()
}


def parse_chapter(line: bytes) -> ChapterLine | None:
    """A line without its LF; None for boot chatter and whatever else has not the form of its letter."""
    pattern, kind = _PATTERNS.get(line[:1], (None, ChapterLine))
    found = pattern and pattern.fullmatch(line)
    return kind(*map(_number, found.groups())) if found else None


def duty_line(left: int, right: int) -> bytes:
    """`s LEFT RIGHT` and CR: duties of -DUTY_FULL..DUTY_FULL."""
    return b"s %d %d\r" % (left, right)


def _number(word: bytes) -> int | float:
    return float(word) if b"." in word else int(word)


class ChapterReader:
    """Bytes to lines of the dialect."""

    def __init__(self) -> None:
        self._splitter = LineSplitter()
        self.strange = 0
        """Lines of no known form so far."""

    def read(self, data: bytes) -> list[ChapterLine]:
        """The well-formed lines that `data` ends."""
        lines = [parse_chapter(raw) for raw in self._splitter.push(data)]
        self.strange += lines.count(None)
        return [line for line in lines if line is not None]

    def clear(self) -> None:
        """Forget half a line."""
        self._splitter.clear()
