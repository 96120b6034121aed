"""The lines of docs/protocol.md, written a second time on purpose: tests must not trust the program they test."""

from __future__ import annotations

import binascii
from typing import NamedTuple


def framed(text: str) -> bytes:
    """`text` with CRC-16/CCITT-FALSE and line end."""
    data = text.encode("ascii")
    return data + b"*%04X\n" % binascii.crc_hqx(data, 0xFFFF)


class Message(NamedTuple):
    """A line from the board whose CRC holds."""

    letter: str
    sequence: int
    fields: tuple[str, ...]


def unframed(line: bytes) -> Message:
    """Raises AssertionError where the line is damaged."""
    text, star, crc = line.rpartition(b"*")
    assert star and crc == b"%04X" % binascii.crc_hqx(text, 0xFFFF), line
    letter, sequence, *fields = text.decode("ascii").split(" ")
    return Message(letter, int(sequence), tuple(fields))


def messages(data: bytes) -> list[Message]:
    """Of whole lines."""
    assert data == b"" or data.endswith(b"\n")
    return [unframed(line) for line in data.splitlines()]
