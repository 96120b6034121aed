"""The framer on a toy protocol: frames, their times, and what it makes of damaged bytes and of cuts anywhere."""

from __future__ import annotations

from functools import reduce
from itertools import accumulate
from operator import xor

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.byte_frames import ByteFrame, FrameFormat, Framer

BAUD = 100_000
BYTE_NS = 100_000
"""Time of a byte on the line: start bit, eight data bits, stop bit."""
HEADER = 0xAA
FORMAT = FrameFormat(
    find=lambda buffer, start: buffer.find(bytes((HEADER,)), start),
    length=lambda buffer, begin: 0 if begin + 1 == len(buffer) else buffer[begin + 1] or -1,
    valid=lambda frame: len(frame) > 2 and checksum(frame[:-1]) == frame[-1],
)
"""AA | length | payload | checksum: only the first byte has its highest bit set, so that no other begins a frame."""


def checksum(data: bytes) -> int:
    return reduce(xor, data) & 0x7F


def frame_of(payload: bytes) -> bytes:
    body = bytes((HEADER, len(payload) + 3)) + payload
    return body + bytes((checksum(body),))


QUIET = st.binary(max_size=20).map(lambda data: bytes(byte & 0x7F for byte in data))
"""Bytes of which none begins a frame."""
FRAMES = st.lists(QUIET.map(frame_of), min_size=2, max_size=8)
CUTS = st.lists(st.integers(0, 300), max_size=12)


def pushed(stream: bytes, cuts: list[int]) -> tuple[list[ByteFrame], Framer]:
    """Return the frames of a stream that began at 0 and is read at some places, each as soon as it is there."""
    framer, found = Framer(FORMAT, BAUD), []
    places = sorted({min(cut, len(stream)) for cut in cuts} | {len(stream)})
    for begin, end in zip([0, *places], places, strict=False):
        found += framer.push(stream[begin:end], end * BYTE_NS)
    return found, framer


@settings(max_examples=40)
@given(FRAMES, CUTS)
def test_frames_and_their_times_do_not_depend_on_the_reads(frames: list[bytes], cuts: list[int]) -> None:
    found, framer = pushed(b"".join(frames), cuts)
    begins = [0, *accumulate(len(frame) for frame in frames)]
    assert [one.data for one in found] == frames[:-1], "nothing follows the last one yet"
    assert [one.began_ns for one in found] == [begin * BYTE_NS for begin in begins[: len(found)]]
    assert [one.follows for one in found] == [False] + [True] * (len(found) - 1)
    assert framer.damaged == 0


@settings(max_examples=40)
@given(FRAMES, FRAMES, QUIET.filter(bool), CUTS)
def test_a_gap_costs_the_frame_before_it(
    before: list[bytes], after: list[bytes], gap: bytes, cuts: list[int]
) -> None:
    found, framer = pushed(b"".join(before) + gap + b"".join(after), cuts)
    assert [one.data for one in found] == [*before[:-1], *after[:-1]]
    follows = {one.began_ns: one.follows for one in found}
    assert follows[(len(b"".join(before)) + len(gap)) * BYTE_NS] is False
    assert sum(follows.values()) == len(found) - 2
    assert framer.damaged == 1, "the frame behind which no other began"


@settings(max_examples=40)
@given(st.lists(QUIET.map(frame_of), min_size=4, max_size=8), st.data())
def test_one_changed_byte_costs_its_frame_and_no_other(frames: list[bytes], data: st.DataObject) -> None:
    hit = data.draw(st.integers(1, len(frames) - 1))
    at, change = data.draw(st.integers(2, len(frames[hit]) - 1)), data.draw(st.integers(1, 127))
    broken = bytearray(frames[hit])
    broken[at] ^= change
    rest = [frame_of(b"")] * 3
    found, framer = pushed(b"".join([*frames[:hit], broken, *frames[hit + 1 :], *rest]), [])
    assert [one.data for one in found] == [*frames[:hit], *frames[hit + 1 :], *rest[:-1]]
    assert [one.follows for one in found].count(False) == 2, "the first one, and the one behind the damage"
    assert framer.damaged >= 1


def test_a_wrong_length_hides_no_frame_behind_it() -> None:
    frames = [frame_of(bytes((k,) * 5)) for k in range(40)]
    stream = bytearray(b"".join(frames))
    stream[1] = 200
    found, _ = pushed(bytes(stream), [])
    assert [one.data for one in found] == frames[1:-1]


@pytest.mark.parametrize("noise", [b"", b"\x00" * 500, bytes((HEADER,)) * 3, bytes((HEADER, 0)) * 200])
def test_noise_makes_no_frame(noise: bytes) -> None:
    found, _ = pushed(noise, [7])
    assert found == []


def test_noise_is_not_kept() -> None:
    framer = Framer(FORMAT, BAUD)
    for _ in range(100):
        framer.push(b"\x01" * 1000, 0)
    assert len(framer._buffer) == 0
