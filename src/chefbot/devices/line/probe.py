"""Which dialect speaks at a port, if any: asked with handshakes, answered by lines."""

from __future__ import annotations

from typing import Literal

from chefbot.devices.line.chapter_lines import ChapterReader
from chefbot.devices.line.frame import LineSplitter, frame
from chefbot.devices.line.lines import PROTOCOL, OtherVersion, Version, parse

Dialect = Literal["board", "chapter"]
ASK_NS = 200_000_000
"""Pause between two handshakes."""
CHAPTER_NS = 1_500_000_000
"""A board that has not answered for so long, and sends the chapter's lines, is the chapter's."""
CHAPTER_LINES = 20
PATIENCE_NS = 4_000_000_000
"""An Arduino Mega restarts when its port is opened, and waits a second or two for a new program."""


class Probe:
    """Send `ask`, feed `hear`, until there is a verdict or `over`."""

    def __init__(self, token: int, now_ns: int) -> None:
        self._token, self._began_ns, self._asked_ns = token, now_ns, now_ns - ASK_NS
        self._splitter, self._chapter = LineSplitter(), ChapterReader()
        self._chapter_lines = self._board_lines = 0
        self.dialect: Dialect | None = None

    def ask(self, now_ns: int) -> bytes:
        """What to send now; call it often."""
        if now_ns - self._asked_ns < ASK_NS:
            return b""
        self._asked_ns = now_ns
        return b"\n" + frame(f"v {self._token} {PROTOCOL}")

    def hear(self, data: bytes, now_ns: int) -> Dialect | None:
        """The verdict after more bytes."""
        for raw in self._splitter.push(data):
            line = parse(raw)
            self._board_lines += line is not None
            if isinstance(line, Version | OtherVersion) and line.token == self._token:
                self.dialect = "board"
        self._chapter_lines += len(self._chapter.read(data))
        waited = now_ns - self._began_ns >= CHAPTER_NS
        if waited and self._board_lines == 0 and self._chapter_lines >= CHAPTER_LINES:
            self.dialect = "chapter"
        return self.dialect

    def over(self, now_ns: int) -> bool:
        """Nobody answers any more."""
        return now_ns - self._began_ns >= PATIENCE_NS

    @property
    def impression(self) -> str:
        """What was there instead of an answer."""
        if self._board_lines:
            return "a board talks there but does not answer: is its receiving wire connected?"
        return "nothing there answers as a board"
