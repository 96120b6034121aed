"""Data formats of the RPLIDAR: packets built bit by bit from the protocol's description, and the emulator's own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.lidar.rplidar_samples import (
    CAPSULES,
    DENSE,
    EXPRESS,
    MAX_STEP,
    ULTRA,
    ULTRA_DENSE,
    Angles,
    Ranges,
    decode_dense,
    decode_express,
    decode_standard,
    decode_ultra,
    decode_ultra_dense,
    encode_dense,
    encode_express,
    encode_standard,
    find_capsule,
    has_valid_checksum,
    is_standard,
    start_angle,
    with_checksum,
)

DEGREE = math.radians(1.0)
RANGES = st.one_of(st.floats(0.01, 16.0), st.just(math.inf))


def many(count: int) -> st.SearchStrategy[Ranges]:
    """Return strategies of so many ranges, some of which are infinite."""

    def ranges(seed: int) -> Ranges:
        rng = np.random.default_rng(seed)
        return np.where(rng.random(count) < 0.2, math.inf, rng.uniform(0.01, 16.0, count))

    return st.integers(0, 2**32).map(ranges)


def word(value: int, size: int = 2) -> bytes:
    return value.to_bytes(size, "little")


def head(degrees: float, *, begins: bool = False) -> bytes:
    """Return a start angle in 1/64 degrees, with the bit that a scan begins."""
    return word(round(64 * degrees) | begins << 15)


def differences(angles: Angles, expected: Angles | float) -> Angles:
    """Return the differences of angles, rad, in [-pi, pi)."""
    return np.asarray((angles - expected + math.pi) % (2.0 * math.pi) - math.pi)


def assert_even(angles: Angles, start: float, end: float) -> None:
    """Angles, rad, start at one and lead in even steps up to but without the other, degrees."""
    step = (end - start) % 360.0 / len(angles)
    expected = DEGREE * (start + step * np.arange(len(angles)))
    assert np.abs(differences(angles, expected)).max() < 1e-9


@given(st.lists(st.tuples(st.floats(0.0, 359.9), RANGES), min_size=1, max_size=8))
def test_standard_samples_decode_to_what_was_encoded(samples: list[tuple[float, float]]) -> None:
    data = b"".join(encode_standard(math.radians(a), r, first=i == 0) for i, (a, r) in enumerate(samples))
    angles, ranges = decode_standard(data)
    degrees = np.array([a for a, _ in samples])
    assert np.abs(differences(angles, np.radians(degrees))).max() <= DEGREE / 127
    assert ranges == pytest.approx(np.array([r for _, r in samples]), abs=0.126e-3)


def test_a_standard_sample_has_the_bits_of_the_protocol() -> None:
    # quality 47, S 0 and not S 1; 90 degrees are 5760 / 64; 1 m is 4000 quarters of a millimetre
    assert encode_standard(math.pi / 2, 1.0, first=False) == bytes((47 << 2 | 2,)) + word(
        5760 << 1 | 1
    ) + word(4000)
    assert encode_standard(math.pi / 2, 1.0, first=True)[0] == 47 << 2 | 1
    assert encode_standard(0.0, 20.0, first=False)[3:] == word(65535), "the largest that it can have"


def group(steps: list[int], start: int = 0) -> bytearray:
    """Return standard samples at angles that increase by steps, in 1/64 degrees."""
    at = np.cumsum([start, *steps]) % (360 * 64)
    return bytearray(b"".join(encode_standard(math.radians(one / 64), 1.0, first=False) for one in at))


@given(st.lists(st.integers(0, MAX_STEP), min_size=7, max_size=7), st.integers(0, 360 * 64 - 1))
def test_angles_that_increase_are_a_group_over_a_full_turn_too(steps: list[int], start: int) -> None:
    assert is_standard(bytes(group(steps, start)))


@pytest.mark.parametrize("step", [MAX_STEP + 1, -1, 180 * 64])
def test_angles_that_leap_or_fall_are_not_a_group(step: int) -> None:
    assert not is_standard(bytes(group([100, 100, step, 100, 100, 100, 100])))


@pytest.mark.parametrize("sample", range(8))
def test_wrong_check_bits_are_not_a_group(sample: int) -> None:
    good = group([60] * 7)
    for byte, bit in ((0, 1), (0, 2), (1, 1)):  # S, not S, and the bit that is always 1
        wrong = good.copy()
        wrong[5 * sample + byte] ^= bit
        assert not is_standard(bytes(wrong))
    beyond = good.copy()
    beyond[5 * sample + 1 : 5 * sample + 3] = word(360 * 64 << 1 | 1)
    assert not is_standard(bytes(beyond)), "360 degrees are not valid"


@given(st.floats(0.0, 359.9), st.floats(0.5, 40.0), many(32))
def test_an_express_capsule_decodes_to_what_was_encoded(start: float, span: float, ranges: Ranges) -> None:
    capsule = encode_express(math.radians(start), ranges, begins=False)
    following = encode_express(math.radians(start + span), ranges, begins=False)
    angles, found = decode_express(capsule, following)
    assert len(capsule) == CAPSULES[EXPRESS].size and has_valid_checksum(capsule)
    assert_even(angles, start_angle(capsule) / 64, start_angle(following) / 64)
    assert found == pytest.approx(ranges, abs=1.01e-3), "steps of a millimetre, rounded down"


def express(cabins: list[tuple[int, int, int, int]], degrees: float) -> bytes:
    """Return an express capsule of (range mm, correction in 1/8 degrees, and both of the second sample)."""
    body = head(degrees)
    for first, turn, second, other in cabins:
        body += word(first << 2 | turn >> 4) + word(second << 2 | other >> 4)
        body += bytes((turn & 15 | (other & 15) << 4,))
    return with_checksum(body)


def test_express_corrections_are_subtracted_from_even_angles() -> None:
    turns = [(k % 64, (63 - k) % 64) for k in range(0, 64, 4)]
    cabins = [(1000 + k, a, 2000 + k, b) for k, (a, b) in enumerate(turns)]
    angles, ranges = decode_express(express(cabins, 350.0), express(cabins, 6.0))
    assert ranges[0::2] == pytest.approx(1.0 + 0.001 * np.arange(16))
    assert ranges[1::2] == pytest.approx(2.0 + 0.001 * np.arange(16))
    even = DEGREE * (350.0 + 0.5 * np.arange(32))
    assert np.abs(differences(angles, even - DEGREE * np.ravel(turns) / 8.0)).max() < 1e-9


@given(st.floats(0.0, 359.9), many(40), st.booleans())
def test_a_dense_capsule_decodes_to_what_was_encoded(start: float, ranges: Ranges, begins: bool) -> None:
    capsule = encode_dense(math.radians(start), ranges, begins=begins)
    following = encode_dense(math.radians(start + 9.0), ranges, begins=False)
    angles, found = decode_dense(capsule, following)
    assert len(capsule) == CAPSULES[DENSE].size and has_valid_checksum(capsule)
    assert bool(capsule[3] & 0x80) == begins, "the bit does not count as an angle"
    assert_even(angles, start_angle(capsule) / 64, start_angle(following) / 64)
    assert found == pytest.approx(ranges, abs=0.501e-3)


def ultra_dense(values: list[int], degrees: float) -> bytes:
    """Return a capsule of 64 values of 20 bits: time and status (6 bytes), angle, and 32 cabins."""
    body = bytes(range(6)) + head(degrees)
    for first, second in zip(values[::2], values[1::2], strict=True):
        body += word(first & 0xFFFF) + word(second & 0xFFFF) + bytes((first >> 16 | second >> 16 << 4,))
    return with_checksum(body)


def ultra_dense_value(millimetres: int, quality: int = 0) -> int:
    """Return the finest value whose range is at most that much."""
    for scale, (bits, step, offset) in enumerate(((10, 2, 0), (11, 3, 2046), (12, 4, 8187), (13, 5, 24567))):
        count = (millimetres - offset) // step
        if 0 <= count < 1 << bits:
            return (quality << bits | count) << 2 | scale
    raise AssertionError(millimetres)


@given(st.integers(0, 2**32), st.integers(0, 31))
def test_ultra_dense_ranges_have_the_step_of_their_scale(seed: int, quality: int) -> None:
    millimetres = np.random.default_rng(seed).integers(0, 60_000, 64).tolist()
    values = [ultra_dense_value(one, quality) for one in millimetres]
    angles, ranges = decode_ultra_dense(ultra_dense(values, 355.0), ultra_dense(values, 3.0))
    assert_even(angles, 355.0, 3.0)
    steps = np.array([2 + (value & 3) for value in values])
    behind = np.array(millimetres) - np.where(np.isfinite(ranges), 1000.0 * ranges, 0.0)
    assert (behind >= -1e-6).all() and (behind < steps + 1e-6).all()


LEVELS = {0: (0, 0), 512: (512, 1), 1280: (2048, 2), 1792: (4096, 3), 3328: (16384, 4)}
"""Majors at which the step of the range doubles: the range, mm, and the bits of the step."""


def major_range(major: int) -> tuple[int, int]:
    """Return the range of a major, mm, and the bits of its step, by counting up."""
    value, level = 0, 0
    for k in range(major):
        level = LEVELS.get(k, (0, level))[1]
        value += 1 << level
    return value, LEVELS.get(major, (0, level))[1]


def ultra(cabins: list[tuple[int, int, int]], degrees: float) -> bytes:
    """Return a capsule of cabins: a major of 12 bits and two predictions of 10 bits with a sign."""
    packed = [major | (a & 0x3FF) << 12 | (b & 0x3FF) << 22 for major, a, b in cabins]
    return with_checksum(head(degrees) + b"".join(word(one, 4) for one in packed))


def ultra_ranges(cabins: list[tuple[int, int, int]]) -> Ranges:
    """Return the decoded ranges of cabins behind which one without a range follows."""
    filled = cabins + [(0, 0, 0)] * (33 - len(cabins))
    _, ranges = decode_ultra(ultra(filled[:32], 10.0), ultra(filled[32:] + filled[1:32], 20.0))
    return ranges


def test_ultra_majors_count_in_steps_that_double() -> None:
    for major in [1, 511, 512, 513, 1279, 1280, 1281, 1791, 1792, 3327, 3328, 4095]:
        assert ultra_ranges([(major, 0, 0)])[0] == pytest.approx(major_range(major)[0] / 1000.0), major
    for major, (millimetres, level) in LEVELS.items():
        assert major_range(major) == (millimetres, level)


@given(st.integers(1, 4095), st.integers(1, 4095), st.integers(-511, 510), st.integers(-511, 510))
def test_ultra_predictions_start_from_both_neighbours(
    major: int, later: int, first: int, second: int
) -> None:
    ranges = ultra_ranges([(major, first, second), (later, 0, 0)])
    for k, (at, prediction) in enumerate(((major, first), (later, second)), start=1):
        base, level = major_range(at)
        millimetres = base + prediction * 2**level
        assert ranges[k] == (pytest.approx(millimetres / 1000.0) if millimetres > 0 else math.inf)


def test_ultra_predictions_of_nothing_are_not_a_measurement() -> None:
    for nothing in (-512, 511):
        ranges = ultra_ranges([(1000, nothing, 5), (1000, 5, nothing)])
        assert np.isinf(ranges[[1, 5]]).all() and np.isfinite(ranges[[0, 2, 3, 4]]).all()
    assert np.isinf(ultra_ranges([(0, 7, 7)])).all(), "without a range on either side"
    ranges = ultra_ranges([(0, 7, 7), (1000, 0, 0)])
    base, level = major_range(1000)
    assert np.isinf(ranges[0]), "a cabin without a range of its own is predicted from the next one"
    assert ranges[1:3] == pytest.approx((base + 7 * 2**level) / 1000.0)


def test_the_last_ultra_cabin_needs_the_next_capsule() -> None:
    cabins = [(0, 0, 0)] * 31 + [(1000, 3, 4)]
    following = [(2000, 0, 0)] + [(0, 0, 0)] * 31
    _, ranges = decode_ultra(ultra(cabins, 10.0), ultra(following, 20.0))
    (near, step), (far, far_step) = major_range(1000), major_range(2000)
    expected = [near, near + 3 * 2**step, far + 4 * 2**far_step]
    assert ranges[-3:] == pytest.approx(np.array(expected) / 1000.0)


def test_ultra_angles_are_corrected_for_the_lens() -> None:
    """By 8 degrees for what is far, 7.5 degrees within 5 cm, and between them by the SDK's series of the range."""
    cabins = [(4095, 0, 0), (400, 0, 0)] + [(0, 0, 0)] * 30
    angles, ranges = decode_ultra(ultra(cabins, 10.0), ultra(cabins, 22.0))
    off = 10.0 + 0.125 * np.arange(96) - np.degrees(angles)
    assert ranges[[0, 3]] == pytest.approx([28.656, 0.4])
    assert off[0] == pytest.approx(8.0, abs=0.05)
    assert off[9] == pytest.approx(7.5)
    k = 98361 // 1600
    assert off[3] == pytest.approx(8.0 - math.degrees(k / 1024 + k**3 / (98304 * 65536)))


@given(st.binary(min_size=2, max_size=170), st.data())
def test_a_changed_byte_is_a_wrong_checksum(body: bytes, data: st.DataObject) -> None:
    capsule = bytearray(with_checksum(body))
    assert has_valid_checksum(bytes(capsule)) and find_capsule(capsule, 0) == 0
    at, change = data.draw(st.integers(2, len(capsule) - 1)), data.draw(st.integers(1, 255))
    capsule[at] ^= change
    assert not has_valid_checksum(bytes(capsule))


@given(st.lists(st.sampled_from([0xA0, 0xAF, 0x50, 0x5F, 0x00, 0xA5]), max_size=12), st.integers(0, 12))
def test_a_capsule_is_found_where_its_first_nibbles_are(data: list[int], start: int) -> None:
    digits = "".join(f"{byte >> 4:x}" for byte in data)
    pairs = [k for k in range(start, len(data)) if digits[k : k + 2] == "a5" or digits[k:] == "a"]
    assert find_capsule(bytearray(data), start) == (pairs[0] if pairs else -1)


@pytest.mark.parametrize(("kind", "size"), [(EXPRESS, 84), (ULTRA, 132), (DENSE, 84), (ULTRA_DENSE, 170)])
def test_a_capsule_of_zeros_has_no_range_and_its_samples(kind: int, size: int) -> None:
    layout = CAPSULES[kind]
    capsule = with_checksum(bytes(size - 2))
    angles, ranges = layout.decode(capsule, capsule)
    assert layout.size == size and len(angles) == len(ranges) == layout.samples
    assert np.isinf(ranges).all()
