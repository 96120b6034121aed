"""Fuzzes the computer's end of the line: `python -m tests.devices.host_fuzz SECONDS [SEED]`.

A true board (the firmware's library) and our session talk; between them lines are lost, doubled, swapped, cut,
spliced, damaged bit by bit, buried in random bytes, and (every second seed) forged with a right CRC. A judge with a
splitter and CRC of its own checks what was believed, what was sent, and that nothing moves that nobody commanded.
"""

from __future__ import annotations

import binascii
import math
import random
import re
import sys
import time
import traceback
from typing import NamedTuple

import numpy as np
from tests.devices.chapter_board import ChapterBoard
from tests.firmware.host_board import HostBoard

from chefbot.board.autodetect import ProtocolProbe
from chefbot.board.chapter_board import ChapterLink
from chefbot.board.framing import MAX_LINE_LENGTH
from chefbot.board.link import BoardLink
from chefbot.board.sequence_filter import ReceivedLine
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import Imu
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
BEAT_NS = 10_000_000
RUN_BYTES = 2_000_000
"""Then a new board, session and seed."""
OBEYED_NS = 200_000_000
RAMP_NS = 2_000_000_000
"""A commanded stop ends within it."""
SENT_LINE = re.compile(rb"(v|x|h|c|r|s) (\d{1,9})(?: (-?\d{1,9}))?(?: (-?\d{1,9}))?", re.ASCII)
FIELDS = {b"v": 2, b"x": 1, b"h": 1, b"c": 1, b"s": 3}
LETTERS = {
    "MotionLine": b"e",
    "InertiaLine": b"i",
    "StatusLine": b"s",
    "EchoLine": b"u",
    "BatteryLine": b"b",
    "UptimeLine": b"t",
    "VersionLine": b"v",
    "UnsupportedVersionLine": b"v",
}
EXTREMES = (
    b"0",
    b"-1",
    b"65535",
    b"65536",
    b"4294967295",
    b"-2147483648",
    b"9999999999",
    b"99999999999",
    b"nan",
    b"",
)


class FindingError(AssertionError):
    """What must not be."""


class Tally(NamedTuple):
    """What one run did."""

    bytes: int
    believed: int
    damaged: int
    sessions: int
    moving: int
    """Control steps with a duty."""


class Judge:
    """The wire cut into lines and their CRC checked, written apart from the program."""

    def __init__(self) -> None:
        self._rest = b""

    def good(self, data: bytes) -> list[bytes]:
        """Lines that end in `data` and whose CRC holds."""
        *ended, self._rest = (self._rest + data).split(b"\n")
        return [line for line in ended if len(line) <= MAX_LINE_LENGTH and self._holds(line)]

    def forget(self) -> None:
        """The cable was pulled in the middle of a line."""
        self._rest = b""

    @staticmethod
    def _holds(line: bytes) -> bool:
        text, star, crc = line.rpartition(b"*")
        return bool(star) and crc == b"%04X" % binascii.crc_hqx(text, 0xFFFF)


def framed(text: bytes) -> bytes:
    """With a right CRC."""
    return text + b"*%04X\n" % binascii.crc_hqx(text, 0xFFFF)


class Wire:
    """From the board to the computer."""

    def __init__(self, chance: random.Random, forges: bool) -> None:
        self._chance, self._forges = chance, forges
        self._old: list[bytes] = []

    def pass_on(self, lines: list[bytes]) -> bytes:
        """What comes out of true lines, each with its LF."""
        out = []
        for line in lines:
            self._old = [*self._old[-50:], line]
            kind = self._chance.random()
            out += (
                [line] if kind < 0.55 else self._spoil(line, self._chance.randrange(9 if self._forges else 8))
            )
        if self._chance.random() < 0.02:
            self._chance.shuffle(out)
        return b"".join(out)

    def noise(self) -> bytes:
        """Random bytes, some with many line ends or stars."""
        data = self._chance.randbytes(self._chance.randrange(1, 600))
        if self._chance.random() < 0.5:
            data = data.translate(bytes(b"\n*v e0123456789ABCDEF"[byte % 21] for byte in range(256)))
        return data

    def _spoil(self, line: bytes, kind: int) -> list[bytes]:
        chance, at = self._chance, self._chance.randrange(len(line))
        if kind == 0:
            return []
        if kind == 1:
            return [line, line]
        if kind == 2:
            return [line[:at]]
        if kind == 3:
            return [line[:at] + line]
        if kind == 4:
            return [bytes(byte ^ (1 << chance.randrange(8)) * (chance.random() < 0.02) for byte in line)]
        if kind == 5:
            return [line[:at] + chance.randbytes(chance.randrange(1, 8)) + line[at:]]
        if kind == 6:
            return [self.noise(), line]
        if kind == 7:
            return [line[:at] + line[at + chance.randrange(1, 4) :]]
        return [self._forged(line)]

    def _forged(self, line: bytes) -> bytes:
        """Wrong in meaning, right in CRC."""
        chance = self._chance
        fields = (chance.choice(self._old) if chance.random() < 0.3 else line).rpartition(b"*")[0].split(b" ")
        for _ in range(chance.randrange(3)):
            fields[chance.randrange(len(fields))] = chance.choice(EXTREMES)
        if chance.random() < 0.1:
            fields.append(chance.choice(EXTREMES))
        return framed(b" ".join(fields))


class Talk:
    """A board, our end, and somebody upstream who drives, rests, is silent and sends nonsense."""

    def __init__(self, seed: int, forges: bool) -> None:
        self.chance = random.Random(seed)
        self.board, self.link = HostBoard(), BoardLink(ROBOT, seed)
        self.chapter, self.chapter_board = ChapterLink(ROBOT), ChapterBoard()
        self.probe = ProtocolProbe(1, 0)
        self.wire, self.judge = Wire(self.chance, forges), Judge()
        self.forges = forges
        self.now = 0
        self.bytes = self.believed = self.moving = 0
        self._rest = b""
        self._command: float | None = 0.0
        self._driven_ns = self._command_ns = -RAMP_NS
        self._stamp_ns = 0
        self._sequence = 65535
        self._kept: list[ReceivedLine] = []
        self.newest: WheelTicks | None = None
        self.receive_data = self.link.session.receive_data
        self.link.session.receive_data = self._note  # type: ignore[method-assign]

    def _note(self, data: bytes, now_ns: int) -> list[ReceivedLine]:
        self._kept = self.receive_data(data, now_ns)
        return self._kept

    def beat(self) -> None:
        """One control step of everybody."""
        self.now += BEAT_NS
        self._upstream()
        self._board_step()
        data = self.board.read()
        *lines, self._rest = (self._rest + data).splitlines(keepends=True) if data else [self._rest]
        if self._rest.endswith(b"\n"):
            lines, self._rest = [*lines, self._rest], b""
        self.listen(self.wire.pass_on([line for line in lines if line]))
        if self.chance.random() < 0.01:
            self._resynchronise()

    def _upstream(self) -> None:
        if self.chance.random() < 0.01:
            self._command = self.chance.choice([None, 0.0, 0.2, 0.3, -0.2, math.nan, math.inf, 1e300])
            self._command_ns = self.now
        if self._command is not None and self.now % (5 * BEAT_NS) == 0:
            wheel = self._command / ROBOT.wheel_radius
            self.send(self.link.command(wheel, wheel, self.now))
            if math.isfinite(self._command) and self._command != 0.0:
                self._driven_ns = self.now
        if self.now % (2 * BEAT_NS) == 0:
            self.send(self.link.data_to_send(self.now))
        if self.chance.random() < 0.0005:
            self.send(self.link.stop(self.now))
            self.link.clear(self.now + BEAT_NS)
        if self.chance.random() < 0.001:
            self.link.connection_lost()
            self.judge.forget()
        if self.now % (100 * BEAT_NS) == 0:
            self.link.report("fuzz", self.now)

    def send(self, data: bytes) -> None:
        """To the board, of the protocol's form and nothing else."""
        for line in data.split(b"\n"):
            form = SENT_LINE.fullmatch(line.rpartition(b"*")[0])
            if line and not (form and framed(line[: line.rindex(b"*")]) == line + b"\n"):
                raise FindingError(f"the session sent {line!r}")
            if form and sum(field is not None for field in form.groups()[1:]) != FIELDS[form[1]]:
                raise FindingError(f"the session sent {line!r}")
        if data:
            self.board.write(data)

    def _board_step(self) -> None:
        self.board.set_imu_at_rest()
        before = self.board.state
        for wheel in (0, 1):
            self.board.lib.chefbot_board_turn(self.board.handle, wheel, before.set[wheel] // 100)
        self.board.lib.chefbot_board_advance(self.board.handle, BEAT_NS // 1000)
        state = self.board.state
        moves = any(state.duty) or any(state.set)
        self.moving += moves
        if moves and self._command is None and self.now - max(self._command_ns, self._driven_ns) > OBEYED_NS:
            raise FindingError("it moves and nobody commands")
        if moves and self.now - self._driven_ns > RAMP_NS:
            raise FindingError("it moves long after the last command to move")

    def listen(self, data: bytes) -> list[ReceivedLine]:
        """What our end makes of it."""
        self.bytes += len(data)
        good = self.judge.good(data)
        messages = self.link.receive_data(data, self.now)
        self.believed += len(self._kept)
        names = iter([line.split(b" ")[:2] for line in good])
        for received in self._kept:
            letter, sequence = LETTERS[type(received.line).__name__], received.line.sequence
            if not any(
                name[0] == letter and int(name[1]) == sequence for name in names if name[-1].isdigit()
            ):
                raise FindingError(f"{received.line} was believed and was not on the wire")
            ahead = (sequence - self._sequence) % 65536
            if not self.forges and not received.restarted and not 0 < ahead < 32768:
                raise FindingError(f"{received.line} was believed after number {self._sequence}")
            self._sequence = sequence
        for message in messages:
            self._look_at(message)
        self.chapter.receive_data(data, self.now)
        self.probe.receive_data(data, self.now)
        return self._kept

    def _look_at(self, message: Message) -> None:
        if isinstance(message, Imu):
            w = message.angular_velocity
            if not np.isfinite([w.x, w.y, w.z, *message.angular_velocity_covariance]).all():
                raise FindingError(f"not a number in {message}")
        if isinstance(message, WheelTicks):
            self.newest = message
            stamp = message.header.stamp.ns
            if not self.forges and stamp < self._stamp_ns:
                raise FindingError(f"a stamp of {stamp} behind one of {self._stamp_ns}")
            self._stamp_ns = stamp

    def _resynchronise(self) -> None:
        """Noise and its line end: of damaged (not forged) lines nothing is left, the next true line counts."""
        self.listen(self.wire.noise() + b"\n")
        self.listen(self.chapter_board.turn())
        if self.forges:
            return
        self._board_step()
        self.now += BEAT_NS
        whole = [
            line
            for line in (self._rest + self.board.read()).splitlines(keepends=True)
            if line.endswith(b"\n")
        ]
        self._rest = b""
        if whole and len(self.listen(whole[0])) != 1:
            raise FindingError(f"the line after the noise was not believed: {whole[0]!r}")
        self.listen(b"".join(whole[1:]))


def fuzz(seed: int, count: int) -> Tally:
    """So many bytes at least; FindingError, or whatever the program raises."""
    talk = Talk(seed, forges=seed % 2 == 0)
    while talk.bytes < count:
        talk.beat()
    session = talk.link.session
    return Tally(talk.bytes, talk.believed, session.damaged, session.handshakes, talk.moving)


def run(seconds: float, seed: int) -> int:
    """New seeds until the time is over; exit code."""
    began, total, believed, seeds = time.monotonic(), 0, 0, 0
    while time.monotonic() - began < seconds:
        try:
            tally = fuzz(seed + seeds, RUN_BYTES)
        except Exception:
            traceback.print_exc()
            sys.stdout.write(f"host fuzz: 1 finding, seed {seed + seeds}, above\n")
            return 1
        total, believed, seeds = total + tally.bytes, believed + tally.believed, seeds + 1
    took = time.monotonic() - began
    rate, last = total / took / 1e6, seed + seeds - 1
    sys.stdout.write(
        f"host fuzz: {total} bytes in {took:.0f} s ({rate:.2f} MB/s), seeds {seed} to {last}: "
        f"{believed} lines believed, all of them true to their CRC; 0 findings\n"
    )
    return 0


if __name__ == "__main__":
    sys.exit(run(float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else time.time_ns() % 1_000_000))
