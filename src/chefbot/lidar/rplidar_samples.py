"""Data formats of the RPLIDAR: packets to angles and ranges. Source: Slamtec's rplidar_sdk at 99478e5.

Angles are clockwise, rad; ranges m, inf where nothing was measured. Formats but the standard one send capsules, which
have the angle of their first sample only: they can be decoded when the next one is there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

STANDARD, EXPRESS, HQ, ULTRA, DENSE, ULTRA_DENSE = 0x81, 0x82, 0x83, 0x84, 0x85, 0x86
"""Types of data, as in the descriptor of an answer."""
FULL_TURN = 360 * 64
"""A turn in the units of capsules' angles."""

Angles = NDArray[np.float64]
Ranges = NDArray[np.float64]


def metres(millimetres: NDArray[np.float64]) -> Ranges:
    """Return ranges in m, inf where they are 0."""
    return np.where(millimetres > 0.0, millimetres / 1000.0, math.inf)


GROUP, SAMPLE_SIZE = 8, 5
"""Samples of the standard format that are taken together, and the size of one, bytes: it has no checksum, but check
bits and angles that increase, which random bytes hold for so many in a row hardly ever."""
MAX_STEP = 5 * 64
"""Largest angle between two samples of a group, in 1/64 degrees."""


def _standard_columns(group: bytes) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return quality with flags, angle with its check bit, and range of each sample of a group."""
    rows = np.frombuffer(group, np.uint8).reshape(-1, SAMPLE_SIZE).astype(np.int64)
    return rows[:, 0], rows[:, 1] | rows[:, 2] << 8, rows[:, 3] | rows[:, 4] << 8


def decode_standard(group: bytes) -> tuple[Angles, Ranges]:
    """Decode a group; of each sample quality and flags, angle << 1 | 1 in 1/64 degrees, range in quarters of a mm."""
    _, angle, quarter = _standard_columns(group)
    return np.radians((angle >> 1) / 64.0), metres(quarter / 4.0)


def is_standard(group: bytes) -> bool:
    """Return whether angles increase and check bits hold: S and not S differ, the lowest bit of the angle is 1."""
    flags, angle, _ = _standard_columns(group)
    steps = np.mod(np.diff(angle >> 1), FULL_TURN)
    in_turn = bool(((angle >> 1) < FULL_TURN).all())
    return in_turn and bool(((flags ^ flags >> 1) & angle & 1).all() and (steps <= MAX_STEP).all())


def start_angle(capsule: bytes, at: int = 2) -> int:
    """Return the angle of a capsule's first sample in 1/64 degrees, without the highest bit: that a scan begins."""
    return int.from_bytes(capsule[at : at + 2], "little") & 0x7FFF


def _even_angles(start: int, end: int, count: int) -> Angles:
    """Return `count` angles from the start angle of a capsule, evenly spaced up to that of the next one."""
    span = (end - start) % FULL_TURN
    return np.asarray(np.radians((start + span * np.arange(count) / count) / 64.0))


def decode_express(capsule: bytes, following: bytes) -> tuple[Angles, Ranges]:
    """Decode 32 samples: 16 cabins of two ranges with the low bits of their angle corrections, and the high bits."""
    cabins = np.frombuffer(capsule, np.dtype([("d", "<u2", 2), ("high", "u1")]), 16, 4)
    pairs, high = cabins["d"].astype(np.int64), cabins["high"].astype(np.int64)
    nibbles = np.column_stack([high & 0x0F, high >> 4])
    correction = ((pairs & 3) << 4 | nibbles).reshape(-1) / 8.0
    angles = _even_angles(start_angle(capsule), start_angle(following), 32)
    return angles - np.radians(correction), metres((pairs & 0xFFFC).reshape(-1) / 4.0)


def decode_dense(capsule: bytes, following: bytes) -> tuple[Angles, Ranges]:
    """Decode 40 samples: ranges in mm."""
    millimetres = np.frombuffer(capsule, "<u2", 40, 4).astype(np.float64)
    return _even_angles(start_angle(capsule), start_angle(following), 40), metres(millimetres)


def decode_ultra_dense(capsule: bytes, following: bytes) -> tuple[Angles, Ranges]:
    """Decode 64 samples: 32 cabins of two values of 20 bits, whose lowest two are the scale of the range."""
    cabins = np.frombuffer(capsule, np.dtype([("low", "<u2", 2), ("high", "u1")]), 32, 10)
    high = cabins["high"].astype(np.int64)
    values = (cabins["low"].astype(np.int64) | np.column_stack([high & 0x0F, high >> 4]) << 16).reshape(-1)
    scale = values & 3
    # bits of the range, mm per step, and the range of the first step, by scale
    mask, step, offset = (
        np.array(column)[scale]
        for column in ((0xFFC, 0x1FFC, 0x3FFC, 0x7FFC), (2, 3, 4, 5), (0, 2046, 8187, 24567))
    )
    millimetres = ((values & mask) >> 2) * step + offset
    angles = _even_angles(start_angle(capsule, 8), start_angle(following, 8), 64)
    return angles, metres(millimetres.astype(np.float64))


_LEVELS = ((3328, 1 << 14, 4), (1792, 1 << 12, 3), (1280, 1 << 11, 2), (512, 1 << 9, 1), (0, 0, 0))
"""From which value of a major on which range (mm) and how many bits of shift, beginning with the largest."""
NO_PREDICTION = (-512, 511)
"""Predictions that stand for no measurement."""


def _major(value: int) -> tuple[int, int]:
    """Return the range, mm, of a major of 12 bits, and the shift of what is predicted from it."""
    first, base, level = next(entry for entry in _LEVELS if value >= entry[0])
    return base + ((value - first) << level), level


def _lens_correction(millimetres: float) -> float:
    """Return by how much the angle of a sample is less than even spacing gives, rad."""
    if millimetres < 50.0:
        return math.radians(7.5)
    k = math.floor(98361 / (4.0 * millimetres))
    return math.radians(8.0) - (k / 1024.0 + k**3 / (98304.0 * 65536.0))


def _signed(value: int) -> int:
    return value - 1024 if value >= 512 else value


def decode_ultra(capsule: bytes, following: bytes) -> tuple[Angles, Ranges]:
    """Decode 96 samples: 32 cabins of a range and two predictions, from it and from the next cabin's range."""
    cabins = np.frombuffer(capsule, "<u4", 32, 4).tolist()
    cabins.append(int.from_bytes(following[4:8], "little"))
    millimetres: list[float] = []
    for word, after in pairwise(cabins):
        (major, level), (later, later_level) = _major(word & 0xFFF), _major(after & 0xFFF)
        base, base_level = (major, level) if major else (later, later_level)
        first, second = _signed(word >> 12 & 0x3FF), _signed(word >> 22 & 0x3FF)
        millimetres.append(major)
        millimetres.append(0 if first in NO_PREDICTION or not base else base + (first << base_level))
        millimetres.append(0 if second in NO_PREDICTION or not later else later + (second << later_level))
    ranges = np.maximum(np.array(millimetres, np.float64), 0.0)
    angles = _even_angles(start_angle(capsule), start_angle(following), 96)
    return angles - np.array([_lens_correction(one) for one in ranges.tolist()]), metres(ranges)


class CapsuleFormat(NamedTuple):
    """A kind of capsule: its size, its samples, how it is decoded, and where the angle of its first sample is."""

    size: int
    samples: int
    decode: Callable[[bytes, bytes], tuple[Angles, Ranges]]
    angle_at: int = 2


CAPSULES = {
    EXPRESS: CapsuleFormat(84, 32, decode_express),
    ULTRA: CapsuleFormat(132, 96, decode_ultra),
    DENSE: CapsuleFormat(84, 40, decode_dense),
    ULTRA_DENSE: CapsuleFormat(170, 64, decode_ultra_dense, angle_at=8),
}
"""Formats of capsules by type."""


def find_capsule(buffer: bytearray, start: int) -> int:
    """Return where the next capsule may begin: a byte with A in its high nibble, and one with 5."""
    for begin in range(start, len(buffer)):
        if buffer[begin] >> 4 == 0xA and (begin + 1 == len(buffer) or buffer[begin + 1] >> 4 == 0x5):
            return begin
    return -1


def has_valid_checksum(capsule: bytes) -> bool:
    """Return whether the low nibbles of the first two bytes are the exclusive or of all others."""
    checksum = int(np.bitwise_xor.reduce(np.frombuffer(capsule, np.uint8, offset=2)))
    return checksum == (capsule[0] & 0x0F | (capsule[1] & 0x0F) << 4)


def with_checksum(body: bytes) -> bytes:
    """Return a capsule with the bytes `body` behind its checksum."""
    checksum = int(np.bitwise_xor.reduce(np.frombuffer(body, np.uint8)))
    return bytes((0xA0 | checksum & 0x0F, 0x50 | checksum >> 4)) + body


def encode_standard(angle: float, metres: float, *, first: bool) -> bytes:
    """Return a sample as the lidar sends it; angle: clockwise, rad; metres: inf for nothing."""
    word = (round(math.degrees(angle) * 64.0) % FULL_TURN) << 1 | 1
    quarter = round(metres * 4000.0) if math.isfinite(metres) else 0
    flags = 0xBC | (1 if first else 2)
    return bytes((flags,)) + word.to_bytes(2, "little") + min(quarter, 65535).to_bytes(2, "little")


def _capsule_head(start: float, *, begins: bool) -> bytes:
    word = round(math.degrees(start) * 64.0) % FULL_TURN | (0x8000 if begins else 0)
    return word.to_bytes(2, "little")


def encode_express(start: float, ranges: Ranges, *, begins: bool) -> bytes:
    """Return a capsule of 32 samples without angle corrections; start: clockwise, rad; ranges: m, inf for nothing."""
    quarters = (
        np.where(np.isfinite(ranges), np.rint(ranges * 4000.0), 0.0).clip(0, 65535).astype("<u2") & 0xFFFC
    )
    cabins = np.zeros(16, np.dtype([("d", "<u2", 2), ("high", "u1")]))
    cabins["d"] = quarters.reshape(16, 2)
    return with_checksum(_capsule_head(start, begins=begins) + cabins.tobytes())


def encode_dense(start: float, ranges: Ranges, *, begins: bool) -> bytes:
    """Return a capsule of 40 samples; start: clockwise, rad; ranges: m, inf for nothing."""
    millimetres = np.where(np.isfinite(ranges), np.rint(ranges * 1000.0), 0.0).clip(0, 65535).astype("<u2")
    return with_checksum(_capsule_head(start, begins=begins) + millimetres.tobytes())
