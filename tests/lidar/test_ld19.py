"""Frames of the LD19: the example of its data sheet, encoding and decoding, and what no lidar sends."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.lidar.ld19 import HEADER, LAYOUT, POINTS, Ld19Session, crc8, encode
from chefbot.lidar.revolutions import Samples

BAUD, RATE = 230_400, 4500.0
DATA_SHEET_RATE = 2270.0
"""Samples a second of the example: 11 steps in 10.43 degrees at 2152 degrees/s."""
BYTE_NS = 10e9 / BAUD
DATA_SHEET = bytes.fromhex(
    "54 2C 68 08 AB 7E E0 00 E4 DC 00 E2 D9 00 E5 D5 00 E3 D3 00 E4 D0 00 E9 CD 00 E4 CA 00 E2 C7 00 E9"
    "C5 00 E5 C2 00 E5 C0 00 E5 BE 82 3A 1A 50"
)
"""2152 degrees/s, from 324.27 to 334.7 degrees, ranges from 224 down to 192 mm."""
MILLIMETRES = [224, 220, 217, 213, 211, 208, 205, 202, 199, 197, 194, 192]


def received(*frames: bytes, rate: float = RATE) -> tuple[list[Samples], Ld19Session]:
    """Return the samples of frames, and the session; a further frame has begun behind them at 1 s."""
    session = Ld19Session(BAUD, rate)
    return session.receive_data(b"".join(frames) + HEADER, 10**9), session


def bitwise_crc(data: bytes) -> int:
    """Return the CRC as the division of polynomials that it is."""
    rest = int.from_bytes(data, "big") << 8
    for bit in range(8 * len(data) - 1, -1, -1):
        if rest >> (bit + 8) & 1:
            rest ^= 0x14D << bit
    return rest


def with_fields(speed: int, start: int, end: int) -> bytes:
    """Return a frame with any angles, in hundredths of a degree, and a valid checksum."""
    body = LAYOUT.pack(HEADER, speed, start, *(1000, 200) * POINTS, end, 0, 0)[:-1]
    return body + bytes((bitwise_crc(body),))


@given(st.binary(max_size=60))
def test_the_checksum_is_the_rest_of_the_division(data: bytes) -> None:
    assert crc8(data) == bitwise_crc(data)
    assert crc8(data + bytes((crc8(data),))) == 0


def test_the_example_of_the_data_sheet() -> None:
    (samples,), session = received(DATA_SHEET, rate=DATA_SHEET_RATE)
    assert samples.ranges == pytest.approx(np.array(MILLIMETRES) / 1000.0)
    angles = np.radians(324.27 + (334.7 - 324.27) * np.arange(12) / 11)
    assert samples.bearings == pytest.approx(2.0 * math.pi - angles), "counter-clockwise"
    assert session.damaged == 0


def test_the_last_sample_is_as_old_as_its_frame() -> None:
    (samples,), _ = received(with_fields(3600, 0, 880))
    began_ns = 10**9 - (LAYOUT.size + len(HEADER)) * BYTE_NS
    assert samples.times_ns[-1] == pytest.approx(began_ns, abs=2)
    assert np.diff(samples.times_ns) == pytest.approx(1e9 / RATE, abs=1)


@given(
    st.floats(0.0, 2.0 * math.pi - 1e-3),
    st.floats(0.001, 0.16),
    st.integers(0, 2**32),
)
def test_a_frame_decodes_to_what_was_encoded(start: float, span: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    ranges = np.where(rng.random(POINTS) < 0.2, math.inf, rng.uniform(0.001, 65.0, POINTS))
    frame = encode(start, start + span, ranges, 2.0 * math.pi * 10.0, 1234)
    (samples,), session = received(frame)
    assert len(frame) == LAYOUT.size and session.damaged == 0
    assert samples.ranges == pytest.approx(ranges, abs=0.0005 + 1e-9)
    angles = start + span * np.arange(POINTS) / (POINTS - 1)
    off = (samples.bearings + angles + math.pi) % (2.0 * math.pi) - math.pi
    assert np.abs(off).max() <= math.radians(0.0051), "also where the angles pass a full turn"


@pytest.mark.parametrize(
    ("speed", "start", "end", "plausible"),
    [
        (3600, 0, 1400, True),  # 12 samples are 9.6 degrees; up to 1.5 times as much counts
        (3600, 0, 1440, True),
        (3600, 0, 1441, False),
        (3600, 35_900, 500, True),
        (3600, 500, 400, False),  # nearly a turn
        (3600, 36_000, 36_100, False),
        (3600, 35_999, 100, True),
        (0, 100, 101, False),
        (0, 100, 100, True),
    ],
)
def test_angles_that_the_speed_does_not_allow_are_left_out(
    speed: int, start: int, end: int, plausible: bool
) -> None:
    sound = encode(0.0, 0.15, np.full(POINTS, 2.0), 2.0 * math.pi * 10.0, 0)
    (samples,), session = received(with_fields(speed, start, end), sound)
    assert samples.ranges.tolist() == [1.0] * POINTS * plausible + [2.0] * POINTS
    assert session.damaged == (not plausible)


@given(st.integers(0, LAYOUT.size - 1), st.integers(1, 255))
def test_a_frame_with_a_changed_byte_has_no_samples(at: int, change: int) -> None:
    broken = bytearray(DATA_SHEET)
    broken[at] ^= change
    samples, session = received(bytes(broken))
    assert samples == [] and session.damaged == (at >= len(HEADER)), "without its header it is not a frame"


def test_nothing_is_sent_to_a_lidar_that_takes_no_commands() -> None:
    session = Ld19Session(BAUD, RATE)
    assert session.data_to_send(0) == session.stop_command() == b""


def test_ranges_beyond_the_format_are_its_largest() -> None:
    frame = encode(0.0, 0.1, np.full(POINTS, 70.0), 60.0, 0)
    assert struct.unpack_from("<H", frame, 6) == (65535,)
