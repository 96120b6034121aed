"""Detect which protocol a device at a serial port uses: it is only read first, then sent handshakes."""

from __future__ import annotations

from typing import Literal

from chefbot.board.chapter_messages import ChapterReader
from chefbot.board.framing import LineSplitter, frame, unframe
from chefbot.board.messages import PROTOCOL, UnsupportedVersionLine, VersionLine, parse

BoardProtocol = Literal["board", "chapter"]
HANDSHAKE_PERIOD_NS = 200_000_000
"""Pause between two handshakes, ns."""
CHAPTER_DETECTION_NS = 1_500_000_000
"""A port that has sent lines of the chapter's protocol for this long, ns, and none of ours, is the chapter's
board."""
MIN_CHAPTER_LINES = 20
"""Minimum number of lines of the chapter's protocol before it is detected."""
MAX_OTHER_BYTES = 20_000
"""Number of bytes without any line of a motor board after which another device is there: a lidar, which sends
forever, reaches it in a few seconds; what else boot loaders and operating systems print at their start is less."""
DETECTION_TIMEOUT_NS = 12_000_000_000
"""Timeout of the detection, ns. Opening its port resets an Arduino Mega. A byte within the next second, for
example from a program that looks for a modem, keeps its boot loader waiting for a new program until 5 s after
the last byte."""


class ProtocolProbe:
    """Detects the protocol at one port.

    Send what `data_to_send` returns and pass received bytes to `receive_data` until there is a verdict or
    `timed_out`.

    Nothing is sent before a line with a valid CRC has been received. Our boards send 50 lines a second
    without a request, whereas a byte to a boot loader delays the start of its board, and other devices cannot
    use our handshake.
    """

    def __init__(self, token: int, now_ns: int) -> None:
        self._token, self._start_ns, self._handshake_ns = token, now_ns, now_ns - HANDSHAKE_PERIOD_NS
        self._splitter, self._chapter = LineSplitter(), ChapterReader()
        self._chapter_lines = self._board_lines = self._received = 0
        self.dialect: BoardProtocol | None = None

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the bytes to send now, empty between two handshakes; call it often."""
        if not self._board_lines or now_ns - self._handshake_ns < HANDSHAKE_PERIOD_NS:
            return b""
        self._handshake_ns = now_ns
        return b"\n" + frame(f"v {self._token} {PROTOCOL}")

    def receive_data(self, data: bytes, now_ns: int) -> BoardProtocol | None:
        """Process received bytes and return the detected protocol, None as long as it is unknown."""
        self._received += len(data)
        for raw in self._splitter.push(data):
            line = parse(raw)
            # Our protocol: a valid checksum is evidence, an answer with our token is proof.
            self._board_lines += unframe(raw) is not None
            if isinstance(line, VersionLine | UnsupportedVersionLine) and line.token == self._token:
                self.dialect = "board"
        self._chapter_lines += len(self._chapter.read(data))
        # The chapter's protocol has no checksum: require many well-formed lines and none of ours.
        detection_over = now_ns - self._start_ns >= CHAPTER_DETECTION_NS
        if detection_over and self._board_lines == 0 and self._chapter_lines >= MIN_CHAPTER_LINES:
            self.dialect = "chapter"
        return self.dialect

    def timed_out(self, now_ns: int) -> bool:
        """Return whether the timeout `DETECTION_TIMEOUT_NS` has passed without a verdict, or another device sends."""
        return self._is_other_device or now_ns - self._start_ns >= DETECTION_TIMEOUT_NS

    @property
    def _is_other_device(self) -> bool:
        return self._received >= MAX_OTHER_BYTES and not self.has_received_lines

    @property
    def has_received_lines(self) -> bool:
        """Whether lines of a motor board of either protocol were received."""
        return self._board_lines > 0 or self._chapter_lines >= MIN_CHAPTER_LINES

    @property
    def failure_reason(self) -> str:
        """Describe what was received instead of an answer, as a sentence for the operator."""
        if self._board_lines:
            return "a board sends data but does not answer: is its RX wire connected?"
        if self._is_other_device:
            return "the data there are not from a motor board: is it the lidar, or another baud rate?"
        return "no motor board answers there: is the firmware flashed (`chefbot board flash`)?"
