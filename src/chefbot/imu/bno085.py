"""BNO085 and BNO086 in the mode UART-RVC: 100 frames a second, sent without a request at 115200 baud.

Frame, little-endian, 19 bytes: AA AA | index u8 | yaw, pitch, roll, 0.01 degrees i16 | acceleration x, y, z,
0.001 g i16 | three bytes that are not used | sum of the bytes from the index on, modulo 256. Source: data sheet
BNO08X (CEVA), section 1.3.5.
"""

from __future__ import annotations

import math
import struct

from chefbot.byte_frames import FrameFormat, Framer
from chefbot.imu.session import STANDARD_GRAVITY, UNMEASURED_VARIANCE, ImuSample, ImuSession
from chefbot.maths.clock_sync import ClockSync

HEADER = bytes((0xAA, 0xAA))
LAYOUT = struct.Struct("<2sB3h3h3sB")
BAUD, PERIOD_US = 115_200, 10_000
CENTIDEGREE = math.radians(0.01)
FULL_TURN = 36_000
"""Centidegrees."""
INDEX_COUNT = 256
MAX_LOST = 10
"""Frames after whose loss the angle between two frames is not taken for a rate."""


def checksum(frame: bytes) -> int:
    """Return the sum that a frame has to end with."""
    return sum(frame[2:-1]) % 256


FORMAT = FrameFormat(
    find=lambda buffer, start: buffer.find(HEADER[:1], start),
    length=lambda buffer, begin: (
        0 if begin + 1 == len(buffer) else LAYOUT.size if buffer[begin + 1] == HEADER[1] else -1
    ),
    valid=lambda frame: checksum(frame) == frame[-1],
    pauses=True,
)


class Bno085Session(ImuSession):
    """Yaw rates from the difference of two yaw angles, which the sensor integrates at a higher rate."""

    def __init__(self) -> None:
        self._framer = Framer(FORMAT, BAUD)
        self._clock: ClockSync | None = None
        self._index, self._yaw, self._sent_us = 0, 0, 0

    def data_to_send(self, now_ns: int) -> bytes:  # noqa: ARG002 (interface)
        """Return nothing: the sensor takes no commands in this mode."""
        return b""

    def receive_data(self, data: bytes, received_ns: int) -> list[ImuSample]:
        """Return a sample for each frame but the first."""
        samples = (self._sample(frame.data, frame.began_ns) for frame in self._framer.push(data, received_ns))
        return [sample for sample in samples if sample is not None]

    @property
    def damaged(self) -> int:
        """Number of frames with a wrong checksum."""
        return self._framer.damaged

    def _sample(self, frame: bytes, began_ns: int) -> ImuSample | None:
        _, index, yaw, _, _, x, y, z, _, _ = LAYOUT.unpack(frame)
        step = (index - self._index) % INDEX_COUNT or INDEX_COUNT
        turn = (yaw - self._yaw + FULL_TURN // 2) % FULL_TURN - FULL_TURN // 2
        self._index, self._yaw = index, yaw
        # after a long gap the index may have wrapped: the sensor's clock begins again
        if self._clock is None or step > MAX_LOST:
            self._clock, self._sent_us = ClockSync(0, began_ns), 0
            return None
        self._sent_us += step * PERIOD_US
        # two roundings of 0.01 degrees, each uniform: variance q^2 / 12
        seconds = 1e-6 * step * PERIOD_US
        variance = CENTIDEGREE**2 / 6.0 / seconds**2
        force = (x * 1e-3 * STANDARD_GRAVITY, y * 1e-3 * STANDARD_GRAVITY, z * 1e-3 * STANDARD_GRAVITY)
        return ImuSample(
            self._clock.stamp(self._sent_us, began_ns),
            (0.0, 0.0, turn * CENTIDEGREE / seconds),
            (UNMEASURED_VARIANCE, UNMEASURED_VARIANCE, variance),
            force,
        )


def encode(index: int, yaw: float, acceleration: tuple[float, float, float]) -> bytes:
    """Return a frame as the sensor sends it; yaw: rad, acceleration: m/s^2."""
    centidegrees = (round(yaw / CENTIDEGREE) + FULL_TURN // 2) % FULL_TURN - FULL_TURN // 2
    force = (round(1e3 * a / STANDARD_GRAVITY) for a in acceleration)
    frame = LAYOUT.pack(HEADER, index % INDEX_COUNT, centidegrees, 0, 0, *force, b"\0\0\0", 0)
    return frame[:-1] + bytes((checksum(frame),))
