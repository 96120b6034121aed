"""The computer's side of the protocol: handshake, sequence numbers, what is sent when.

It reads no clock: time is an argument.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.board.compatibility import constant_differences, incompatibility
from chefbot.board.framing import LineSplitter, frame
from chefbot.board.messages import (
    PROTOCOL,
    MotionLine,
    StatusLine,
    UnsupportedVersionLine,
    VersionLine,
    parse,
)
from chefbot.board.sequence_filter import ReceivedLine, SequenceFilter
from chefbot.board.status_codes import BoardFlag
from chefbot.robot.spec import Robot

REPEAT_NS = 20_000_000
"""Period at which a speed command is repeated, ns, as lines may be lost."""
COMMAND_TIMEOUT_NS = 40_000_000
"""Time for which a command is repeated, ns; then nothing is sent, and 150 ms later the board stops. With 10
ms left for the serial link, the wheels turn for at most 200 ms after the sender of a command has crashed, and
two of three lines may be lost."""
MAX_TICKS_AGE_NS = 250_000_000
"""Maximum age of the board's ticks, ns: the motion is unknown then, and a stop is sent instead of a speed.
Twelve lines in a row are lost then; where two of five are, that happens once in an hour of driving."""
HEARTBEAT_NS = 200_000_000
"""Period of the heartbeat, ns; a session ends after 1 s without one."""
HANDSHAKE_NS = 200_000_000
"""Pause between two handshakes, ns."""
SETTLE_NS = 100_000_000
"""Time after the handshake's answer for which the board's session flag is ignored, ns: it was measured before
the answer."""
SILENCE_NS = 1_000_000_000
"""Timeout without a line, ns, after which the board counts as absent."""
TOKENS, RECENT_TOKENS = 900_000_000, 10
"""Range of the handshake tokens, and the number of recent ones that are accepted: an answer may be received
after the next handshake was sent; the last answer gives the sequence number that holds."""
CLEAR_NS = 200_000_000
"""Time for which a clear is repeated, ns, as lines may be lost."""


class _Command(NamedTuple):
    left: int
    right: int
    time_ns: int


class BoardSession:
    """The session with one board: pass received bytes to `receive_data` and send what the other methods return.

    After a handshake or a clear, no motion is passed on until a stop was commanded once: an old command must
    not start the robot.
    """

    def __init__(self, robot: Robot, token: int = 0) -> None:
        """`token`: any number, preferably different for each process, to recognize answers to the handshakes
        of another one."""
        self._robot = robot
        self._ignored = BoardFlag.IMU_BAD if robot.sensors.imu.driver else 0
        self._splitter = LineSplitter()
        self.stream = SequenceFilter()
        self._token = token % TOKENS
        self._handshake_ns = self._sent_ns = -(1 << 62)
        self._open_ns: int | None = None
        self._last_line_ns: int | None = None
        self._last_byte_ns: int | None = None
        """Time of the last received bytes, ns, complete lines or not."""
        self._motion_ns = -(1 << 62)
        self._sequence = 0
        self._command: _Command | None = None
        self._stopped = False
        self._clear_ns: int | None = None
        self.neutral_first = True
        """Whether a stop must be commanded before a motion is passed on."""
        self.damaged = 0
        """Number of lines without a valid checksum or format."""
        self.handshakes = 0
        self.version: VersionLine | None = None
        """The last handshake answer of a compatible board."""
        self.refused: str | None = None
        """Why the board may not drive this robot; then only handshakes are sent."""
        self.warning: str | None = None
        """How the firmware's constants differ from the robot file."""
        self.flags = 0
        """Flags of the last line that has them."""

    @property
    def is_open(self) -> bool:
        """Whether the handshake is complete and the board accepts commands."""
        return self._open_ns is not None

    def silent(self, now_ns: int) -> bool:
        """Return whether no valid line was received for a second, or none at all."""
        return self._last_line_ns is None or now_ns - self._last_line_ns > SILENCE_NS

    def waiting_for_stop(self, now_ns: int) -> bool:
        """Return whether a motion is commanded that is not passed on, as a stop must be commanded first."""
        command = self._command
        fresh = command is not None and now_ns - command.time_ns < SILENCE_NS
        return self.is_open and self.neutral_first and fresh

    def ticks_stale(self, now_ns: int) -> bool:
        """Return whether ticks are too old to pass speeds on: the link is bad or the board is silent."""
        return self.is_open and now_ns - self._motion_ns > MAX_TICKS_AGE_NS

    # -- from the board

    def receive_data(self, data: bytes, now_ns: int) -> list[ReceivedLine]:
        """Process received bytes and return the accepted lines in them, in order."""
        accepted = []
        self._last_byte_ns = now_ns if data else self._last_byte_ns
        for raw in self._splitter.push(data):
            line = parse(raw)
            self.damaged += line is None
            received = self.stream.accept(line, now_ns) if line is not None else None
            if received is not None:
                self._last_line_ns = now_ns
                self._process(received, now_ns)
                accepted.append(received)
        return accepted

    def connection_lost(self) -> None:
        """Discard a partly received line, the session and all commands after the connection was lost."""
        self._splitter.clear()
        self._close()

    def _process(self, received: ReceivedLine, now_ns: int) -> None:
        line = received.line
        # A restart of the board ends the session.
        if received.restarted:
            self._close()
        if isinstance(line, VersionLine | UnsupportedVersionLine):
            self._check_answer(line, now_ns)
        if isinstance(line, MotionLine):
            self._motion_ns = now_ns
        # Both lines report the flags; they also show a session that the board has closed.
        if isinstance(line, MotionLine | StatusLine):
            self.flags = line.flags & ~self._ignored
            self._check_session_flag(now_ns)

    def _check_session_flag(self, now_ns: int) -> None:
        if self._open_ns is None or now_ns - self._open_ns < SETTLE_NS:
            return
        if self.flags & BoardFlag.NO_SESSION:
            self._close()

    def _check_answer(self, answer: VersionLine | UnsupportedVersionLine, now_ns: int) -> None:
        # Accept answers to the last few handshakes only, not to those of another program.
        if (self._token - answer.token) % TOKENS >= RECENT_TOKENS:
            return
        self.refused = incompatibility(answer, self._robot)
        if self.refused is not None or isinstance(answer, UnsupportedVersionLine):
            self._close()
            return
        self.version, self.warning = answer, constant_differences(answer, self._robot)
        # A new session starts with the sequence number given by the board.
        self._open_ns, self._sequence = now_ns, answer.first
        self._sent_ns = -(1 << 62)
        self.neutral_first = True
        self.handshakes += 1

    def _close(self) -> None:
        self._open_ns = self._command = self._clear_ns = None
        self.neutral_first = True

    # -- to the board

    def command(self, left: float, right: float, now_ns: int) -> bytes:
        """Set the requested angular velocities of the wheels, rad/s; return the bytes to send at once. Values
        that are not finite are ignored."""
        if not (math.isfinite(left) and math.isfinite(right)):
            return b""
        # Convert rad/s of a wheel to ticks/s.
        scale = self._robot.motor.ticks_per_radian
        requested = _Command(_ticks(left * scale), _ticks(right * scale), now_ns)
        self.neutral_first = self.neutral_first and not (
            self.is_open and requested.left == requested.right == 0
        )
        self._command = requested
        return self._send_speed(now_ns) if self.is_open else b""

    def stop(self, now_ns: int) -> bytes:
        """Latch the emergency stop until `clear`; return the bytes to send at once. `data_to_send` repeats them
        until the board has confirmed the stop.

        A board that restarts in the meantime is stopped again.
        """
        self._stopped, self._clear_ns, self._command = True, None, None
        return self._emergency_stop(now_ns)

    def clear(self, now_ns: int) -> None:
        """Clear latched faults whose cause is gone, with the next `data_to_send`."""
        self._stopped, self._command = False, None
        self._clear_ns, self.neutral_first = now_ns, True

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the bytes that are due; call it every `REPEAT_NS`.

        Nothing is sent to a board from which nothing is received: if it was reset, a byte keeps its boot
        loader from starting the program.
        """
        if self._last_byte_ns is not None and now_ns - self._last_byte_ns > SILENCE_NS:
            self._close()
            return b""
        # 1. Emergency stop, until the board reports it as latched.
        if self._stopped and not self.flags & BoardFlag.ESTOP_COMMAND:
            return self._emergency_stop(now_ns) + (b"" if self.is_open else self._handshake(now_ns))
        # 2. Handshake, until the board answers.
        if not self.is_open:
            return self._handshake(now_ns)
        # 3. Clear, followed by a stop, for CLEAR_NS.
        if self._clear_ns is not None:
            self._clear_ns = self._clear_ns if now_ns - self._clear_ns < CLEAR_NS else None
            return self._numbered("c", now_ns) + self._numbered("s", now_ns, 0, 0)
        # 4. Repeat a fresh command; else only a heartbeat: the board's watchdog stops the wheels.
        if self._command is not None and now_ns - self._command.time_ns < COMMAND_TIMEOUT_NS:
            return self._send_speed(now_ns)
        return self._numbered("h", now_ns) if now_ns - self._sent_ns >= HEARTBEAT_NS else b""

    def _send_speed(self, now_ns: int) -> bytes:
        assert self._command is not None
        clearing = self._clear_ns is not None
        refused = clearing or bool(self.flags & BoardFlag.NEUTRAL_FIRST)
        must_stop = self.neutral_first or refused or self.ticks_stale(now_ns)
        left, right = (0, 0) if must_stop else (self._command.left, self._command.right)
        return self._numbered("s", now_ns, left, right)

    def _handshake(self, now_ns: int) -> bytes:
        """Return a handshake after a LF, which ends any partial line in the board's buffer."""
        if now_ns - self._handshake_ns < HANDSHAKE_NS:
            return b""
        self._handshake_ns = now_ns
        self._token = (self._token + 1) % TOKENS
        return b"\n" + frame(f"v {self._token} {PROTOCOL}")

    def _emergency_stop(self, now_ns: int) -> bytes:
        self._sent_ns = now_ns if self.is_open else self._sent_ns
        heartbeat = self._numbered("h", now_ns) if self.is_open else b""
        return frame(f"x {self._token}") + heartbeat

    def _numbered(self, letter: str, now_ns: int, *numbers: int) -> bytes:
        self._sequence = (self._sequence + 1) % 65536
        self._sent_ns = now_ns
        return frame(" ".join([letter, str(self._sequence), *map(str, numbers)]))


def _ticks(speed: float) -> int:
    """Round to whole ticks/s of at most nine digits."""
    return round(max(-999_999_999.0, min(999_999_999.0, speed)))
