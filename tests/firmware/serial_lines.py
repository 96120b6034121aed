"""An independent implementation of the serial lines of docs/protocol.md, so that tests do not use the tested one."""

from __future__ import annotations

import binascii
from typing import NamedTuple


def add_checksum(text: str) -> bytes:
    """Return `text` with CRC-16/CCITT-FALSE and line end."""
    data = text.encode("ascii")
    return data + b"*%04X\n" % binascii.crc_hqx(data, 0xFFFF)


class Message(NamedTuple):
    """A line from the board with a valid CRC."""

    letter: str
    sequence: int
    fields: tuple[str, ...]


def parse_message(line: bytes) -> Message:
    """Return the message of a line; AssertionError if the line is corrupt."""
    text, star, crc = line.rpartition(b"*")
    assert star and crc == b"%04X" % binascii.crc_hqx(text, 0xFFFF), line
    letter, sequence, *fields = text.decode("ascii").split(" ")
    return Message(letter, int(sequence), tuple(fields))


def parse_messages(data: bytes) -> list[Message]:
    """Return the messages of complete lines."""
    assert data == b"" or data.endswith(b"\n")
    return [parse_message(line) for line in data.splitlines()]
