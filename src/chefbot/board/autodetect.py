"""Which dialect speaks at a port, if any: listened for first, then asked with handshakes."""

from __future__ import annotations

from typing import Literal

from chefbot.board.chapter_messages import ChapterReader
from chefbot.board.framing import LineSplitter, frame, unframe
from chefbot.board.messages import PROTOCOL, OtherVersion, Version, parse

Dialect = Literal["board", "chapter"]
ASK_NS = 200_000_000
"""Pause between two handshakes."""
CHAPTER_NS = 1_500_000_000
"""A port that has sent the chapter's lines for so long, and none of ours, is the chapter's board."""
CHAPTER_LINES = 20
PATIENCE_NS = 12_000_000_000
"""Opening its port resets an Arduino Mega. A byte within the next second, from a program that looks for a modem for
example, keeps its boot loader waiting for a new program until 5 s after the last byte."""


class Probe:
    """Send `ask`, feed `hear`, until there is a verdict or `over`.

    Nothing is sent before a line with a valid CRC has come. Every board of ours sends 50 lines a second unasked,
    whereas a byte to a boot loader holds its board up, and other devices have no use for our handshake.
    """

    def __init__(self, token: int, now_ns: int) -> None:
        self._token, self._began_ns, self._asked_ns = token, now_ns, now_ns - ASK_NS
        self._splitter, self._chapter = LineSplitter(), ChapterReader()
        self._chapter_lines = self._board_lines = 0
        self.dialect: Dialect | None = None

    def ask(self, now_ns: int) -> bytes:
        """What to send now; call it often."""
        if not self._board_lines or now_ns - self._asked_ns < ASK_NS:
            return b""
        self._asked_ns = now_ns
        return b"\n" + frame(f"v {self._token} {PROTOCOL}")

    def hear(self, data: bytes, now_ns: int) -> Dialect | None:
        """The verdict after more bytes."""
        for raw in self._splitter.push(data):
            line = parse(raw)
            self._board_lines += unframe(raw) is not None
            if isinstance(line, Version | OtherVersion) and line.token == self._token:
                self.dialect = "board"
        self._chapter_lines += len(self._chapter.read(data))
        waited = now_ns - self._began_ns >= CHAPTER_NS
        if waited and self._board_lines == 0 and self._chapter_lines >= CHAPTER_LINES:
            self.dialect = "chapter"
        return self.dialect

    def over(self, now_ns: int) -> bool:
        """No board has spoken or answered for `PATIENCE_NS`."""
        return now_ns - self._began_ns >= PATIENCE_NS

    @property
    def impression(self) -> str:
        """What was there instead of an answer."""
        if self._board_lines:
            return "a board talks there but does not answer: is its receiving wire connected?"
        return "nothing there speaks as a board: has it got its firmware (`chefbot flash`)?"
