"""LD06, LD19, STL-19P and STL-27L of LDROBOT: frames of twelve samples, sent without a request.

Frame, little-endian, 47 bytes: 54 2C | speed, degrees/s u16 | start angle, 0.01 degrees u16 | 12 x (range mm u16,
intensity u8) | end angle u16 | time, ms u16 | CRC-8 of the bytes before (polynomial 0x4D, initial value 0, not
reflected). Source: LDROBOT's ldlidar_stl_ros2 at bf668a8.
"""

from __future__ import annotations

import math
import struct

import numpy as np

from chefbot.byte_frames import ByteFrame, FrameFormat, Framer
from chefbot.lidar.revolutions import Samples, bearings_of
from chefbot.lidar.session import LidarSession

HEADER = bytes((0x54, 0x2C))
POINTS = 12
"""Samples of a frame."""
LAYOUT = struct.Struct("<2sHH" + "HB" * POINTS + "HHB")
FRAME = np.dtype(
    [
        ("header", "S2"),
        ("speed", "<u2"),
        ("start", "<u2"),
        ("points", [("range", "<u2"), ("intensity", "u1")], POINTS),
        ("end", "<u2"),
        ("milliseconds", "<u2"),
        ("crc", "u1"),
    ]
)
STEPS = np.arange(POINTS) / (POINTS - 1)
"""Place of each sample between the first angle and the last one."""
MAX_SPAN = 1.5
"""Angle of a frame, as a multiple of what the speed gives, beyond which its angles are wrong (LDROBOT's code)."""
CENTIDEGREES = 36_000


def _crc_table(polynomial: int) -> bytes:
    table = bytearray()
    for value in range(256):
        for _ in range(8):
            value = (value << 1) ^ polynomial if value & 0x80 else value << 1
        table.append(value & 0xFF)
    return bytes(table)


_TABLE = _crc_table(0x4D)


def crc8(data: bytes) -> int:
    """Return the CRC-8 with the polynomial 0x4D, initial value 0, not reflected."""
    crc = 0
    for byte in data:
        crc = _TABLE[crc ^ byte]
    return crc


FORMAT = FrameFormat(
    find=lambda buffer, start: buffer.find(HEADER[:1], start),
    length=lambda buffer, begin: (
        0 if begin + 1 == len(buffer) else LAYOUT.size if buffer[begin + 1] == HEADER[1] else -1
    ),
    valid=lambda frame: crc8(frame[:-1]) == frame[-1],
)


class Ld19Session(LidarSession):
    """Samples of a lidar that sends as soon as it rotates.

    baud: of the line. sample_rate: samples a second.
    """

    def __init__(self, baud: int, sample_rate: float) -> None:
        self._framer = Framer(FORMAT, baud)
        self._period_ns = 1e9 / sample_rate
        self.sample_rate = sample_rate
        self._implausible = 0

    def data_to_send(self, now_ns: int) -> bytes:  # noqa: ARG002 (interface)
        """Return nothing: the lidar takes no commands."""
        return b""

    def receive_data(self, data: bytes, received_ns: int) -> list[Samples]:
        """Return the samples of the frames that are whole and plausible."""
        frames = self._framer.push(data, received_ns)
        return [self._decode(frames)] if frames else []

    @property
    def damaged(self) -> int:
        """Number of frames with a wrong checksum or angles that the speed does not allow."""
        return self._framer.damaged + self._implausible

    def _decode(self, frames: list[ByteFrame]) -> Samples:
        """Decode frames together, as that takes little longer than for one of them."""
        fields = np.frombuffer(b"".join(frame.data for frame in frames), FRAME)
        start, end = fields["start"].astype(np.float64), fields["end"].astype(np.float64)
        span = np.mod(end - start, CENTIDEGREES)
        widest = MAX_SPAN * 100.0 * fields["speed"] * POINTS / self.sample_rate
        plausible = (np.maximum(start, end) < CENTIDEGREES) & (span <= widest)
        self._implausible += len(frames) - int(plausible.sum())
        # the angles are evenly spaced from the first to the last sample
        angles = np.radians((start[plausible, None] + span[plausible, None] * STEPS) / 100.0).ravel()
        millimetres = fields["points"]["range"][plausible].ravel().astype(np.float64)
        ranges = np.where(millimetres > 0.0, millimetres / 1000.0, math.inf)
        # the last sample was taken when the frame began on the line
        began_ns = np.array([frame.began_ns for frame in frames], np.int64)[plausible]
        ages = np.rint(np.arange(POINTS - 1, -1, -1) * self._period_ns).astype(np.int64)
        return Samples(bearings_of(angles, 0.0), ranges, (began_ns[:, None] - ages).ravel())


def encode(start: float, end: float, ranges: np.ndarray, speed: float, milliseconds: int) -> bytes:
    """Return a frame of POINTS samples as the lidar sends it.

    start, end: angle of the first and the last sample, rad, clockwise, at least 0. ranges: (POINTS,) m, inf for
    nothing. speed: rad/s.
    """
    values = np.where(np.isfinite(ranges), np.rint(ranges * 1000.0), 0.0).clip(0, 65535).astype(int).tolist()
    angles = [round(math.degrees(angle) * 100.0) % CENTIDEGREES for angle in (start, end)]
    points = [part for value in values for part in (value, 200 if value else 0)]
    fields = (HEADER, round(math.degrees(speed)), angles[0], *points, angles[1], milliseconds % 30_000)
    body = LAYOUT.pack(*fields, 0)[:-1]
    return body + bytes((crc8(body),))
