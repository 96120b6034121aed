"""Finds frames with a checksum in a stream of bytes, and the time at which each began."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

BITS_PER_BYTE = 10
"""Bits on the line per byte: start, eight data bits, stop."""


class ByteFrame(NamedTuple):
    """A complete frame with a valid checksum.

    began_ns: time at which its first byte began on the line, ns. follows: whether no byte was between it and the
    frame before.
    """

    data: bytes
    began_ns: int
    follows: bool


class FrameFormat(NamedTuple):
    """How frames of a protocol are found.

    find: index of the first byte from an index on that may begin a frame, -1 for none; the end of the bytes may be
    missing. length: length of the frame that begins at an index, bytes; 0 if more bytes are needed to know it,
    negative if none begins there. valid: whether the checksum of a whole frame is right. pauses: whether the sender
    is silent between two frames.
    """

    find: Callable[[bytearray, int], int]
    length: Callable[[bytearray, int], int]
    valid: Callable[[bytes], bool]
    pauses: bool = False


class Framer:
    """Splits a stream of bytes into the frames of a format; searches on from the next byte after a damaged one.

    A frame counts if its checksum is right and another one begins right behind it: short checksums alone would let
    bytes pass in which some were lost. Of a sender that pauses, a frame that ends the received bytes counts as well.
    """

    def __init__(self, layout: FrameFormat, baud: int) -> None:
        self._layout = layout
        self._byte_ns = BITS_PER_BYTE * 1_000_000_000 / baud
        self._buffer = bytearray()
        self._skipped = True
        self.damaged = 0
        """Number of frames that were found to be damaged."""

    def push(self, data: bytes, received_ns: int) -> list[ByteFrame]:
        """Return the frames that `data` completes, whose last byte was received at `received_ns`."""
        buffer, at = self._buffer, 0
        buffer += data
        frames: list[ByteFrame] = []
        while (begin := self._layout.find(buffer, at)) >= 0:
            self._skipped |= begin > at
            at = begin
            length = self._layout.length(buffer, begin)
            closed = self._begins(begin + length) if length > 0 else length < 0
            if closed is None or length == 0:
                break  # the rest comes later
            frame = bytes(buffer[begin : begin + length]) if length > 0 else b""
            if frame and closed and self._layout.valid(frame):
                began_ns = received_ns - round((len(buffer) - begin) * self._byte_ns)
                frames.append(ByteFrame(frame, began_ns, not self._skipped))
                at, self._skipped = begin + length, False
            else:
                self.damaged += length > 0
                at, self._skipped = begin + 1, True
        else:
            self._skipped |= at < len(buffer)
            at = len(buffer)
        del buffer[:at]
        return frames

    def _begins(self, at: int) -> bool | None:
        """Return whether a frame begins at an index, None if the bytes for that have not come yet."""
        if self._layout.pauses and at == len(self._buffer):
            return True
        if at + 1 >= len(self._buffer):
            return None
        length = self._layout.length(self._buffer, at)
        return None if length == 0 else length > 0 and self._layout.find(self._buffer, at) == at
