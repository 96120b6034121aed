"""Bytes to lines and back: what frames a line of docs/protocol.md, and its CRC."""

from __future__ import annotations

import binascii

LONGEST_LINE = 160
"""Bytes; the board's own buffer holds 120. What is longer is no line."""


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, nothing reflected."""
    return binascii.crc_hqx(data, 0xFFFF)


def frame(text: str) -> bytes:
    """`text` with its CRC and line end, as it goes over the wire."""
    data = text.encode("ascii")
    return data + b"*%04X\n" % crc16(data)


def unframe(line: bytes) -> str | None:
    """The text of a line without its LF, or None unless all of it is printable and the CRC holds."""
    text, star, crc = line.rpartition(b"*")
    if not star or crc != b"%04X" % crc16(text) or not text.isascii():
        return None
    decoded = text.decode("ascii")
    return decoded if decoded.isprintable() else None


class LineSplitter:
    """A stream of bytes cut at LF; holds at most one line, whatever comes.

    A line that grows too long is thrown away up to its LF, and counted.
    """

    def __init__(self, longest: int = LONGEST_LINE) -> None:
        self._longest = longest
        self._part = b""
        self._overlong = False
        self.too_long = 0

    def push(self, data: bytes) -> list[bytes]:
        """The lines that `data` ends, without LF and without empty ones."""
        *ended, rest = data.split(b"\n")
        lines = [line for piece in ended if (line := self._end(piece))]
        self._grow(rest)
        return lines

    def clear(self) -> None:
        """Forget half a line: what comes next has another beginning."""
        self._part, self._overlong = b"", False

    def _end(self, piece: bytes) -> bytes:
        self._grow(piece)
        line = self._part
        self.clear()
        return line

    def _grow(self, piece: bytes) -> None:
        if self._overlong:
            return
        self._part += piece
        if len(self._part) > self._longest:
            self._part, self._overlong = b"", True
            self.too_long += 1
