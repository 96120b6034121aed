"""IMUs of WitMotion (WT901 and its relatives) with the standard protocol: packets of 11 bytes.

Packet, little-endian: 55 | type | four i16 | sum of the ten bytes before, modulo 256. Type 51: acceleration x, y, z,
16 g / 32768, temperature. Type 52: angular velocity x, y, z, 2000 degrees/s / 32768. Command: FF AA | register |
value u16; commands count after an unlock. Source: WIT Standard Communication Protocol (WitMotion).
"""

from __future__ import annotations

import math
import struct

from chefbot.byte_frames import FrameFormat, Framer
from chefbot.imu.session import STANDARD_GRAVITY, ImuSample, ImuSession, Triple
from chefbot.maths.clock_sync import ClockSync

HEADER, ACCELERATION, RATES = 0x55, 0x51, 0x52
TYPES = range(0x50, 0x60)
LAYOUT = struct.Struct("<BB4hB")
G_PER_UNIT, RATE_PER_UNIT = 16.0 / 32768.0, math.radians(2000.0) / 32768.0
UNLOCK = bytes((0xFF, 0xAA, 0x69, 0x88, 0xB5))
CONTENT, RATE = 0x02, 0x03
"""Registers: which packets are sent, and how often."""
ACCELERATION_AND_RATES = 0x0006
RATE_CODES = {20.0: 0x07, 50.0: 0x08, 100.0: 0x09, 200.0: 0x0B}
"""Values of the register RATE by the rate, Hz."""
CONFIGURE_NS = 500_000_000
"""Time between two commands, ns."""


def command(register: int, value: int) -> bytes:
    """Return the command that writes a register; it is lost when the sensor is switched off."""
    return bytes((0xFF, 0xAA, register)) + struct.pack("<H", value)


FORMAT = FrameFormat(
    find=lambda buffer, start: buffer.find(bytes((HEADER,)), start),
    length=lambda buffer, begin: (
        0 if begin + 1 == len(buffer) else LAYOUT.size if buffer[begin + 1] in TYPES else -1
    ),
    valid=lambda frame: sum(frame[:-1]) % 256 == frame[-1],
    pauses=True,
)


class WitMotionSession(ImuSession):
    """Sets the rate and the packets of a sensor, and joins acceleration and angular velocity of one sample."""

    def __init__(self, baud: int, rate: float) -> None:
        """baud: of the line. rate: one of RATE_CODES, Hz."""
        self._framer = Framer(FORMAT, baud)
        self._period_us = round(1e6 / rate)
        self._commands = [UNLOCK, command(CONTENT, ACCELERATION_AND_RATES), command(RATE, RATE_CODES[rate])]
        self._sent_ns = -CONFIGURE_NS
        self._clock: ClockSync | None = None
        self._count_us = 0
        self._force: Triple | None = None

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the next command of the configuration, half a second after the one before."""
        if not self._commands or now_ns - self._sent_ns < CONFIGURE_NS:
            return b""
        self._sent_ns = now_ns
        return self._commands.pop(0)

    def receive_data(self, data: bytes, received_ns: int) -> list[ImuSample]:
        """Return a sample for each packet of angular velocity that follows one of acceleration."""
        samples = []
        for frame in self._framer.push(data, received_ns):
            _, kind, x, y, z, _, _ = LAYOUT.unpack(frame.data)
            if kind == ACCELERATION:
                scale = G_PER_UNIT * STANDARD_GRAVITY
                self._force = (x * scale, y * scale, z * scale)
            elif kind == RATES and self._force is not None:
                rates = (x * RATE_PER_UNIT, y * RATE_PER_UNIT, z * RATE_PER_UNIT)
                samples.append(ImuSample(self._stamp(frame.began_ns), rates, (0.0, 0.0, 0.0), self._force))
                self._force = None
        return samples

    @property
    def damaged(self) -> int:
        """Number of packets with a wrong sum."""
        return self._framer.damaged

    def _stamp(self, began_ns: int) -> int:
        """Return the time of a sample: they are evenly spaced, and a lost one delays the rest for a second."""
        if self._clock is None:
            self._clock = ClockSync(0, began_ns)
        else:
            self._count_us += self._period_us
        return self._clock.stamp(self._count_us, began_ns)


def encode(kind: int, values: Triple, last: int = 0) -> bytes:
    """Return a packet as the sensor sends it; values: m/s^2 or rad/s."""
    unit = G_PER_UNIT * STANDARD_GRAVITY if kind == ACCELERATION else RATE_PER_UNIT
    numbers = (max(-32768, min(32767, round(value / unit))) for value in values)
    packet = LAYOUT.pack(HEADER, kind, *numbers, last, 0)
    return packet[:-1] + bytes((sum(packet[:-1]) % 256,))
