"""YDLIDAR X2, X4, G2, G4 and Tmini: packets of samples with their first and last angle.

Packet, little-endian: AA 55 | CT u8 | LSN u8, samples | FSA u16 | LSA u16 | CS u16 | samples. CT bit 0: the first
sample of a revolution; CT >> 1: revolutions per second times ten, if not 0. Angles: (value >> 1) / 64 degrees,
clockwise, evenly spaced. CS: exclusive or of 55AA and all other 16-bit values. Source: YDLidar-SDK at 01cdda4,
doc/YDLidar-SDK-Communication-Protocol.md.
"""

from __future__ import annotations

import math
import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.byte_frames import ByteFrame, FrameFormat, Framer
from chefbot.lidar.revolutions import Samples, bearings_of
from chefbot.lidar.session import LidarSession

HEADER = bytes((0xAA, 0x55))
HEAD = struct.Struct("<2sBBHHH")
START, STOP = bytes((0xA5, 0x60)), bytes((0xA5, 0x65))
REPEAT_NS = 1_000_000_000
"""Time without a packet after which the scan is started again, ns."""
BEAM_OFFSET, BEAM_DISTANCE = 0.0218, 0.1553
"""Geometry of a triangulating lidar, m: its angles depend on the range, the more the nearer."""
FULL_TURN = 360 * 64
"""A turn in the units of angles."""


class YdlidarModel(NamedTuple):
    """Serial line, rate and data format of a YDLIDAR model.

    baud: of the line. sample_rate: samples a second. intensity_bytes: bytes of the intensity before each range.
    triangulates: whether ranges count quarters of a millimetre and angles need a correction, instead of millimetres.
    one_way: whether it begins to send by itself and takes no commands.
    """

    baud: int
    sample_rate: float
    intensity_bytes: int
    triangulates: bool
    one_way: bool


def angle_correction(ranges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what the angles, clockwise, of a triangulating lidar must be corrected by, rad; 0 without a range.

    ranges: (n,) m. The maker's examples: -6.7622 degrees at 1 m, -7.8374 degrees at 8 m.
    """
    valid = np.isfinite(ranges) & (ranges > 0.0)
    r = np.where(valid, ranges, 1.0)
    return np.where(valid, np.arctan(BEAM_OFFSET / BEAM_DISTANCE * (BEAM_DISTANCE - r) / r), 0.0)


def _format(intensity_bytes: int) -> FrameFormat:
    width = 2 + intensity_bytes

    def length(buffer: bytearray, begin: int) -> int:
        if begin + 4 > len(buffer):
            return 0
        count = buffer[begin + 3]
        return HEAD.size + width * count if buffer[begin + 1] == HEADER[1] and count else -1

    def valid(frame: bytes) -> bool:
        *_, checksum = HEAD.unpack_from(frame)
        return bool(checksum_of(frame, intensity_bytes) == checksum)

    return FrameFormat(lambda buffer, start: buffer.find(HEADER[:1], start), length, valid)


def checksum_of(packet: bytes, intensity_bytes: int) -> int:
    """Return the exclusive or of the 16-bit values of a packet, without its checksum."""
    head = np.frombuffer(packet, "<u2", 4)
    samples = np.frombuffer(packet, np.uint8, offset=HEAD.size).reshape(-1, 2 + intensity_bytes)
    ranges = np.ascontiguousarray(samples[:, intensity_bytes:]).view("<u2")
    checksum = int(np.bitwise_xor.reduce(head)) ^ int(np.bitwise_xor.reduce(ranges.reshape(-1)))
    if intensity_bytes:
        checksum ^= int(np.bitwise_xor.reduce(samples[:, 0]))
    return checksum


class YdlidarSession(LidarSession):
    """Starts the scan, unless the model is one-way, and decodes its packets."""

    def __init__(self, model: YdlidarModel) -> None:
        self._model = model
        self._framer = Framer(_format(model.intensity_bytes), model.baud)
        self._due_ns = -1
        self._implausible = 0

    def data_to_send(self, now_ns: int) -> bytes:
        """Return the request for a scan, and again after a second without packets."""
        if self._model.one_way or now_ns < self._due_ns:
            return b""
        self._due_ns = now_ns + REPEAT_NS
        return START

    def receive_data(self, data: bytes, received_ns: int) -> list[Samples]:
        """Return the samples of each whole packet."""
        frames = self._framer.push(data, received_ns)
        if frames:
            self._due_ns = received_ns + REPEAT_NS
        packets = (self._decode(frame) for frame in frames)
        return [samples for samples in packets if samples is not None]

    @property
    def damaged(self) -> int:
        """Number of packets with a wrong checksum or angles beyond a revolution."""
        return self._framer.damaged + self._implausible

    def stop_command(self) -> bytes:
        """Return the request that ends the scan."""
        return b"" if self._model.one_way else STOP

    def _decode(self, frame: ByteFrame) -> Samples | None:
        _, _, count, first, last, _ = HEAD.unpack_from(frame.data)
        if max(first >> 1, last >> 1) > FULL_TURN:
            self._implausible += 1
            return None
        model = self._model
        samples = np.frombuffer(frame.data, np.uint8, offset=HEAD.size).reshape(count, -1)
        counts = np.ascontiguousarray(samples[:, model.intensity_bytes :]).view("<u2").reshape(-1)
        # triangulating models count quarters of a millimetre; with an intensity, its lowest bits are in the range
        value = (counts & 0xFFFC if model.intensity_bytes else counts).astype(np.float64)
        metres = value / (4000.0 if model.triangulates else 1000.0)
        ranges = np.where(value > 0.0, metres, math.inf)
        # the angles are evenly spaced from the first to the last sample
        span = ((last >> 1) - (first >> 1)) % FULL_TURN
        steps = np.arange(count) / max(count - 1, 1)
        angles = np.radians(((first >> 1) + span * steps) / 64.0)
        if model.triangulates:
            angles = angles + angle_correction(ranges)
        # the last sample was taken when the packet began on the line
        ages = np.rint(np.arange(count - 1, -1, -1) * 1e9 / model.sample_rate).astype(np.int64)
        return Samples(bearings_of(angles, 0.0), ranges, frame.began_ns - ages)


def encode(
    model: YdlidarModel, start: float, end: float, ranges: NDArray[np.float64], *, first: bool
) -> bytes:
    """Return a packet as the lidar sends it.

    start, end: angle of the first and the last sample, rad, clockwise, before the correction of triangulating models.
    ranges: (n,) m, inf for nothing; a zero packet, `first`, has one.
    """
    unit = 4000.0 if model.triangulates else 1000.0
    values = np.where(np.isfinite(ranges), np.rint(ranges * unit), 0.0).clip(0, 65532).astype("<u2")
    if model.intensity_bytes:
        values = values & 0xFFFC
    samples = np.zeros((len(values), 2 + model.intensity_bytes), np.uint8)
    samples[:, model.intensity_bytes :] = values.view(np.uint8).reshape(-1, 2)
    limits = [(round(math.degrees(angle) * 64.0) % FULL_TURN) << 1 | 1 for angle in (start, end)]
    head = HEAD.pack(HEADER, int(first), len(values), *limits, 0)
    checksum = checksum_of(head[:-2] + b"\0\0" + samples.tobytes(), model.intensity_bytes)
    return head[:-2] + struct.pack("<H", checksum) + samples.tobytes()
