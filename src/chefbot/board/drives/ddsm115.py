"""DDSM115 hub motors (also sold as M0601): two wheels with their controllers on one RS-485 line at 115200 baud.

Frames have ten bytes, big-endian. Speed: id | 64 | rpm i16 | 0 0 | acceleration | brake | 0 | CRC-8. Mode: id | A0 |
seven zeros | mode, which is not answered. Answer: id | mode | torque i16 | rpm i16 | position u16, 32768 a turn |
errors | CRC-8 (Maxim's: x^8 + x^5 + x^4 + 1, reflected) of the nine bytes before. Source: Waveshare's wiki page of
the DDSM115.
"""

from __future__ import annotations

import math
import struct

from chefbot.board.command_gate import NEVER_NS
from chefbot.board.drives.drive_link import DriveLink
from chefbot.board.drives.half_duplex import Answer, LineRequest
from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot

LENGTH = 10
SPEED, MODE = 0x64, 0xA0
VELOCITY_MODE = 2
IDS = (1, 2)
"""Of the left and of the right motor."""
FORWARD_SIGNS = (1, -1)
"""Sign of each motor's rotation when the robot drives forward: both shafts point outwards."""
MAX_RPM = 330
COUNTS_PER_TURN, COUNTER_BITS = 32_768, 15
ANSWER = struct.Struct(">BBhhHBB")
PERIOD_NS = 20_000_000
"""Time between two commands of the left motor, ns."""
ERRORS = {
    0x01: "its sensor is damaged",
    0x02: "it takes too much current",
    0x04: "a phase takes too much current",
    0x08: "it is blocked",
    0x10: "it is too hot",
}
NO_WATCHDOG = (
    "DDSM115 motors do not stop when commands end; their speed is limited, and they would go on turning if this"
    " computer failed: add a switch that cuts their supply"
)


def _crc_table(polynomial: int) -> bytes:
    table = bytearray()
    for value in range(256):
        for _ in range(8):
            value = value >> 1 ^ polynomial if value & 1 else value >> 1
        table.append(value)
    return bytes(table)


_TABLE = _crc_table(0x8C)


def crc8(data: bytes) -> int:
    """Return the CRC-8 of Maxim: polynomial 0x31 reflected, initial value 0."""
    crc = 0
    for byte in data:
        crc = _TABLE[crc ^ byte]
    return crc


def speed_frame(motor: int, rpm: int) -> bytes:
    """Return the frame that sets the speed of a motor, with its own acceleration."""
    body = struct.pack(">BBh5x", motor, SPEED, rpm)
    return body + bytes((crc8(body),))


def mode_frame(motor: int) -> bytes:
    """Return the frame that selects control of velocity."""
    return bytes((motor, MODE, *[0] * 7, VELOCITY_MODE))


class Ddsm115Link(DriveLink):
    """The `MotorBoardLink` of two DDSM115 motors."""

    title = "DDSM115"

    def __init__(self, robot: Robot) -> None:
        self._errors = [0, 0]
        super().__init__(robot)

    def connection_lost(self) -> None:
        """Reset the link and both motors."""
        super().connection_lost()
        self._next, self._driven_ns = 0, NEVER_NS
        self._positions: list[int | None] = [None, None]
        self._mode_frames = b""

    @property
    def notice(self) -> str | None:
        """The warning that these motors have no watchdog."""
        return NO_WATCHDOG

    @property
    def problems(self) -> list[str]:
        """Errors in the motors' last answers."""
        return [
            f"The {side} motor has stopped: {text}."
            for side, errors in zip(("left", "right"), self._errors, strict=True)
            for bit, text in ERRORS.items()
            if errors & bit
        ]

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the next request if the line is free, behind the frames of mode that have become due."""
        request = super().data_to_send(now_ns)
        if not request:
            return b""
        modes, self._mode_frames = self._mode_frames, b""
        return modes + request

    def next_request(self, now_ns: int) -> LineRequest | None:
        """Return the speed of the left motor each period, and that of the right one after it."""
        if self._next == 0:
            if now_ns - self._driven_ns < PERIOD_NS:
                return None
            self._driven_ns = now_ns
        wheel, self._next = self._next, 1 - self._next
        rpm = round(FORWARD_SIGNS[wheel] * self.speeds(now_ns)[wheel] * 60.0 / (2.0 * math.pi))
        return speed_request(wheel, max(-MAX_RPM, min(MAX_RPM, rpm)))

    def process(self, answer: Answer) -> list[Message]:
        """Return the ticks after the answer of the right motor."""
        wheel = int(answer.name)
        _, mode, _, _, position, errors, _ = ANSWER.unpack(answer.data)
        self._errors[wheel] = errors
        self._positions[wheel] = FORWARD_SIGNS[wheel] * position
        if mode != VELOCITY_MODE:
            self._mode_frames += mode_frame(IDS[wheel])
        left, right = self._positions
        if wheel == 0 or left is None or right is None:
            return []
        self._positions = [None, None]
        per_count = self.robot.motor.ticks_per_turn / COUNTS_PER_TURN
        return self.ticks((left, right), COUNTER_BITS, per_count, answer.stamp_ns)


def speed_request(wheel: int, rpm: int) -> LineRequest:
    """Return the request that sets the speed of a motor; wheel: 0 for the left one, 1 for the right one."""
    motor = IDS[wheel]
    return LineRequest(
        str(wheel), speed_frame(motor, rpm), lambda _: LENGTH, lambda answer: _is_answer(answer, motor)
    )


def _is_answer(answer: bytes, motor: int) -> bool:
    return answer[0] == motor and crc8(answer[:-1]) == answer[-1]
