"""Our end of the line: handshake, numbers, what is sent when. No clock inside: time is an argument."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.board.compatibility import differences, refusal
from chefbot.board.framing import LineSplitter, frame
from chefbot.board.messages import PROTOCOL, Motion, OtherVersion, Status, Version, parse
from chefbot.board.sequence_filter import Heard, Stream
from chefbot.board.status_codes import Flag
from chefbot.robot.spec import Robot

REPEAT_NS = 20_000_000
"""A speed is said again so often, as lines get lost."""
FRESH_NS = 40_000_000
"""So long it is repeated; then silence, and 150 ms later the board stops. With 10 ms left for the line, wheels get no
more than 200 ms out of a command whose sender has died, and two of three lines may be lost."""
BLIND_NS = 250_000_000
"""Without ticks from the board for so long nobody knows where the robot goes: a stop is said instead of a speed.
Twelve lines in a row are lost then; where two of five are, that happens once in an hour of driving."""
HEARTBEAT_NS = 200_000_000
"""Pause between two signs of life; a session ends after 1 s without."""
HANDSHAKE_NS = 200_000_000
"""Pause between two attempts."""
SETTLE_NS = 100_000_000
"""What the board says of its session so soon after the answer was measured before it."""
SILENCE_NS = 1_000_000_000
"""Without a line for so long there is no board."""
TOKENS, TOKENS_KEPT = 900_000_000, 10
"""An answer may come behind the next question; the last answer tells the numbers that hold."""
CLEAR_NS = 200_000_000
"""So long a clear is repeated, as lines get lost."""


class _Command(NamedTuple):
    left: int
    right: int
    time_ns: int


class Session:
    """Speaks with one board. Feed `hear` with what comes and send what `speak` and the others give.

    A new session, and a clear, drive nothing until a stop was commanded once from above: nobody's old speed
    sets the robot moving.
    """

    def __init__(self, robot: Robot, token: int = 0) -> None:
        """`token`: any number, better another one each time; an answer to an older program is then known."""
        self._robot = robot
        self._splitter = LineSplitter()
        self.stream = Stream()
        self._token = token % TOKENS
        self._asked_ns = self._said_ns = -(1 << 62)
        self._open_ns: int | None = None
        self._heard_ns: int | None = None
        self._received_ns: int | None = None
        """When the last bytes came, whole lines or not."""
        self._motion_ns = -(1 << 62)
        self._sequence = 0
        self._command: _Command | None = None
        self._stopped = False
        self._clear_ns: int | None = None
        self.neutral_first = True
        """Upstream must command a stop before anything else is passed on."""
        self.damaged = 0
        """Lines without a valid CRC or form."""
        self.handshakes = 0
        self.version: Version | None = None
        """The last answer of a board that may drive."""
        self.refused: str | None = None
        """Why the board may not drive this robot; then nothing but handshakes is sent."""
        self.warning: str | None = None
        """What the board knows otherwise than the robot file."""
        self.flags = 0
        """The newest."""

    @property
    def is_open(self) -> bool:
        """A board has answered and listens."""
        return self._open_ns is not None

    def silent(self, now_ns: int) -> bool:
        """No valid line for a second, or none ever."""
        return self._heard_ns is None or now_ns - self._heard_ns > SILENCE_NS

    def held_back(self, now_ns: int) -> bool:
        """A speed is commanded, but it may be an old one: a stop must be commanded first."""
        command = self._command
        fresh = command is not None and now_ns - command.time_ns < SILENCE_NS
        return self.is_open and self.neutral_first and fresh

    def blind(self, now_ns: int) -> bool:
        """The line is so bad, or the board so silent, that speeds are not passed on."""
        return self.is_open and now_ns - self._motion_ns > BLIND_NS

    # -- from the board

    def hear(self, data: bytes, now_ns: int) -> list[Heard]:
        """The lines in `data` that count, in order."""
        counted = []
        self._received_ns = now_ns if data else self._received_ns
        for raw in self._splitter.push(data):
            line = parse(raw)
            self.damaged += line is None
            heard = self.stream.take(line, now_ns) if line is not None else None
            if heard is not None:
                self._heard_ns = now_ns
                self._follow(heard, now_ns)
                counted.append(heard)
        return counted

    def lost_line(self) -> None:
        """The cable was pulled: half a line, the session and all that was commanded are gone."""
        self._splitter.clear()
        self._close()

    def _follow(self, heard: Heard, now_ns: int) -> None:
        line = heard.line
        if heard.restarted:
            self._close()
        if isinstance(line, Version | OtherVersion):
            self._judge(line, now_ns)
        if isinstance(line, Motion):
            self._motion_ns = now_ns
        if isinstance(line, Motion | Status):
            self.flags = line.flags
            self._watch_flags(now_ns)

    def _watch_flags(self, now_ns: int) -> None:
        if self._open_ns is None or now_ns - self._open_ns < SETTLE_NS:
            return
        if self.flags & Flag.NO_SESSION:
            self._close()

    def _judge(self, answer: Version | OtherVersion, now_ns: int) -> None:
        if (self._token - answer.token) % TOKENS >= TOKENS_KEPT:
            return  # to somebody else's question
        self.refused = refusal(answer, self._robot)
        if self.refused is not None or isinstance(answer, OtherVersion):
            self._close()
            return
        self.version, self.warning = answer, differences(answer, self._robot)
        self._open_ns, self._sequence = now_ns, answer.first
        self._said_ns = -(1 << 62)
        self.neutral_first = True
        self.handshakes += 1

    def _close(self) -> None:
        self._open_ns = self._command = self._clear_ns = None
        self.neutral_first = True

    # -- to the board

    def command(self, left: float, right: float, now_ns: int) -> bytes:
        """Rim speeds in m/s that upstream wants now; what to send at once. Not finite: ignored."""
        if not (math.isfinite(left) and math.isfinite(right)):
            return b""
        scale = 1.0 / self._robot.metres_per_tick
        wanted = _Command(_ticks(left * scale), _ticks(right * scale), now_ns)
        self.neutral_first = self.neutral_first and not (self.is_open and wanted.left == wanted.right == 0)
        self._command = wanted
        return self._say_speed(now_ns) if self.is_open else b""

    def stop(self, now_ns: int) -> bytes:
        """Emergency stop until `clear`: what to send at once; `speak` repeats it until the board has taken it.

        A board that restarts meanwhile is stopped again.
        """
        self._stopped, self._clear_ns, self._command = True, None, None
        return self._emergency(now_ns)

    def clear(self, now_ns: int) -> None:
        """Lift latched faults whose cause is gone, from the next `speak` on."""
        self._stopped, self._command = False, None
        self._clear_ns, self.neutral_first = now_ns, True

    def speak(self, now_ns: int) -> bytes:
        """What is due; call it every `REPEAT_NS`. Nothing to a board from which no byte comes: if it was reset, one
        of ours keeps its boot loader from starting the program."""
        if self._received_ns is not None and now_ns - self._received_ns > SILENCE_NS:
            self._close()
            return b""
        if self._stopped and not self.flags & Flag.ESTOP_COMMAND:
            return self._emergency(now_ns) + (b"" if self.is_open else self._ask(now_ns))
        if not self.is_open:
            return self._ask(now_ns)
        if self._clear_ns is not None:
            self._clear_ns = self._clear_ns if now_ns - self._clear_ns < CLEAR_NS else None
            return self._numbered("c", now_ns) + self._numbered("s", now_ns, 0, 0)
        if self._command is not None and now_ns - self._command.time_ns < FRESH_NS:
            return self._say_speed(now_ns)
        return self._numbered("h", now_ns) if now_ns - self._said_ns >= HEARTBEAT_NS else b""

    def _say_speed(self, now_ns: int) -> bytes:
        assert self._command is not None
        clearing = self._clear_ns is not None
        refused = clearing or bool(self.flags & Flag.NEUTRAL_FIRST)
        still = self.neutral_first or refused or self.blind(now_ns)
        left, right = (0, 0) if still else (self._command.left, self._command.right)
        return self._numbered("s", now_ns, left, right)

    def _ask(self, now_ns: int) -> bytes:
        """A handshake, behind a LF that ends whatever the board has heard before."""
        if now_ns - self._asked_ns < HANDSHAKE_NS:
            return b""
        self._asked_ns = now_ns
        self._token = (self._token + 1) % TOKENS
        return b"\n" + frame(f"v {self._token} {PROTOCOL}")

    def _emergency(self, now_ns: int) -> bytes:
        self._said_ns = now_ns if self.is_open else self._said_ns
        beat = self._numbered("h", now_ns) if self.is_open else b""
        return frame(f"x {self._token}") + beat

    def _numbered(self, letter: str, now_ns: int, *numbers: int) -> bytes:
        self._sequence = (self._sequence + 1) % 65536
        self._said_ns = now_ns
        return frame(" ".join([letter, str(self._sequence), *map(str, numbers)]))


def _ticks(speed: float) -> int:
    """Whole ticks/s, of nine digits at most."""
    return round(max(-999_999_999.0, min(999_999_999.0, speed)))
