"""Line framing of docs/protocol.md: bytes to lines with a checksum and back."""

from __future__ import annotations

import binascii

MAX_LINE_LENGTH = 160
"""Maximum length of a line, bytes; the board's own buffer holds 120. Longer lines are discarded."""


def crc16(data: bytes) -> int:
    """Return the CRC-16/CCITT-FALSE: polynomial 0x1021, initial value 0xFFFF, not reflected."""
    return binascii.crc_hqx(data, 0xFFFF)


def frame(text: str) -> bytes:
    """Append the checksum and line end to `text`, as it is sent over the serial link."""
    data = text.encode("ascii")
    return data + b"*%04X\n" % crc16(data)


def unframe(line: bytes) -> str | None:
    """Return the text of a line without its LF; None unless all of it is printable and the checksum is valid."""
    # The checksum covers all bytes before the last "*".
    text, star, crc = line.rpartition(b"*")
    if not star or crc != b"%04X" % crc16(text) or not text.isascii():
        return None
    decoded = text.decode("ascii")
    return decoded if decoded.isprintable() else None


class LineSplitter:
    """Splits a byte stream at LF; buffers at most one line, whatever is received.

    A line that grows too long is discarded up to its LF.
    """

    def __init__(self, longest: int = MAX_LINE_LENGTH) -> None:
        self._max_length = longest
        self._part = b""
        self._overlong = False

    def push(self, data: bytes) -> list[bytes]:
        """Return the lines that are completed by `data`, without LF and without empty ones."""
        *complete, remaining = data.split(b"\n")
        lines = [line for piece in complete if (line := self._complete(piece))]
        self._append(remaining)
        return lines

    def clear(self) -> None:
        """Discard a partly received line, as the next bytes do not continue it."""
        self._part, self._overlong = b"", False

    def _complete(self, piece: bytes) -> bytes:
        self._append(piece)
        line = self._part
        self.clear()
        return line

    def _append(self, piece: bytes) -> None:
        # Skip the rest of an overlong line.
        if self._overlong:
            return
        self._part += piece
        if len(self._part) > self._max_length:
            self._part, self._overlong = b"", True
