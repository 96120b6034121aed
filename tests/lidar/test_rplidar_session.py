"""The dialogue with an RPLIDAR: its requests in order, what the answers change, and which bytes are not an answer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.lidar.revolutions import Samples
from chefbot.lidar.rplidar import (
    ANSWER_PATIENCE_NS,
    DAMAGED,
    EXPRESS_SCAN,
    GET_INFO,
    HEALTH,
    INFO,
    MOTOR_PWM,
    SCAN,
    SILENCE_NS,
    STOP,
    RplidarSession,
    descriptor,
    request,
)
from chefbot.lidar.rplidar_samples import (
    DENSE,
    EXPRESS,
    HQ,
    STANDARD,
    encode_dense,
    encode_express,
    encode_standard,
)
from chefbot.lidar.session import LidarError

BAUD, SAMPLE_NS = 115_200, 125_000.0
MOTOR = bytes.fromhex("A5 F0 02 94 02 C1")
MODEL = {"A2": 0x28, "S1": 0x61, "C1": 0x41}


@pytest.mark.parametrize(
    ("command", "payload", "bytes_"),
    [
        (STOP, b"", "A5 25"),
        (SCAN, b"", "A5 20"),
        (GET_INFO, b"", "A5 50"),
        (EXPRESS_SCAN, bytes(5), "A5 82 05 00 00 00 00 00 22"),
        (MOTOR_PWM, b"\x94\x02", "A5 F0 02 94 02 C1"),
    ],
)
def test_requests_are_those_of_the_protocol_document(command: int, payload: bytes, bytes_: str) -> None:
    assert request(command, payload) == bytes.fromhex(bytes_)


def test_descriptors_are_those_of_the_protocol_document() -> None:
    assert descriptor(20, INFO, stream=False) == bytes.fromhex("A5 5A 14 00 00 00 04")
    assert descriptor(3, HEALTH, stream=False) == bytes.fromhex("A5 5A 03 00 00 00 06")
    assert descriptor(5, STANDARD, stream=True) == bytes.fromhex("A5 5A 05 00 00 40 81")
    assert descriptor(84, EXPRESS, stream=True) == bytes.fromhex("A5 5A 54 00 00 40 82")


def answer(kind: int, content: bytes) -> bytes:
    return descriptor(len(content), kind, stream=False) + content


def setting(number: int, value: bytes) -> bytes:
    return answer(0x20, number.to_bytes(4, "little") + value)


def info(model: int) -> bytes:
    return answer(INFO, bytes((model, 29, 1, 7)) + bytes(range(16)))


def answers(model: int, mode: int = 2, kind: int = DENSE, sample_us: float = 50.0) -> dict[bytes, bytes]:
    """Return the answers of a lidar to the requests by their bytes."""
    number = mode.to_bytes(2, "little")
    return {
        request(GET_INFO): info(model),
        request(0x52): answer(HEALTH, bytes(3)),
        request(0x84, (0x7C).to_bytes(4, "little")): setting(0x7C, number),
        request(0x84, (0x75).to_bytes(4, "little") + number): setting(0x75, bytes((kind,))),
        request(0x84, (0x71).to_bytes(4, "little") + number): setting(
            0x71, round(256 * sample_us).to_bytes(4, "little")
        ),
    }


def talk(session: RplidarSession, known: dict[bytes, bytes], start_ns: int = 0) -> list[tuple[int, bytes]]:
    """Let a session ask until its scan starts; return what it sent, and when (ns)."""
    sent: list[tuple[int, bytes]] = []
    for now_ns in range(start_ns, start_ns + 10_000_000_000, 10_000_000):
        data = session.data_to_send(now_ns)
        if data:
            sent.append((now_ns, data))
            session.receive_data(known.get(data, b""), now_ns)
            if data[1] in (SCAN, EXPRESS_SCAN):
                return sent
    raise AssertionError("it does not start the scan")


def started(kind: int, size: int, **given_by: float) -> RplidarSession:
    """Return a session whose scan has started."""
    session = RplidarSession(BAUD, SAMPLE_NS)
    talk(session, answers(MODEL["A2"], kind=kind, **given_by))  # type: ignore[arg-type]
    assert session.receive_data(descriptor(size, kind, stream=True), 0) == []
    return session


def test_it_starts_the_typical_mode_that_the_lidar_reports() -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    sent = [data for _, data in talk(session, answers(MODEL["A2"], mode=3, sample_us=31.25))]
    assert sent[0] == request(STOP) and sent[-2:] == [MOTOR, request(EXPRESS_SCAN, bytes((3, 0, 0, 0, 0)))]
    assert session.sample_rate == pytest.approx(32_000.0)
    assert session.description == f"model 0x28, firmware 1.29, serial number {bytes(range(16)).hex()}"


def test_firmware_without_answers_gets_the_standard_scan() -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    sent = talk(session, {})
    assert sent[-1][1] == request(SCAN)
    assert np.diff([time for time, _ in sent]).min() >= ANSWER_PATIENCE_NS, "each has its time for an answer"
    assert session.sample_rate == pytest.approx(8000.0) and session.description == ""


def test_an_answer_makes_the_next_request_due_at_once() -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    times = {data: time for time, data in talk(session, answers(MODEL["A2"]))}
    gap = times[request(0x52)] - times[request(GET_INFO)]
    assert 0 < gap < ANSWER_PATIENCE_NS


@pytest.mark.parametrize(("model", "command"), [("A2", 0xF0), ("S1", 0xA8), ("C1", 0xA8)])
def test_the_motor_is_controlled_as_the_model_takes_it(model: str, command: int) -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    sent = [data for _, data in talk(session, answers(MODEL[model]))]
    assert [data[1] for data in sent if data[1] in (0xF0, 0xA8)] == [command]
    assert session.stop_command() == request(STOP) + request(command, b"\0\0")


@pytest.mark.parametrize("status", [0, 1, DAMAGED])
def test_only_a_damaged_lidar_is_an_error(status: int) -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    health = answer(HEALTH, bytes((status, 0x34, 0x12)))
    if status == DAMAGED:
        with pytest.raises(LidarError, match=f"code {0x1234}"):
            session.receive_data(health, 0)
    else:
        assert session.receive_data(health, 0) == []


def test_without_samples_everything_begins_again() -> None:
    session = started(STANDARD, 5)
    last = 10_000_000_000
    session.receive_data(group(0.0) + group(8.0), last)
    assert session.data_to_send(last + SILENCE_NS) == b""
    assert session.data_to_send(last + SILENCE_NS + 1) == request(STOP)
    sent = talk(session, answers(MODEL["A2"]), last + SILENCE_NS + 20_000_000)
    assert sent[-1][1][1] == EXPRESS_SCAN, "and leads to a scan"


@pytest.mark.parametrize(
    ("kind", "size", "name"),
    [(HQ, 777, "HQ"), (0x99, 84, "0x99"), (DENSE, 85, "0x85"), (STANDARD, 84, "0x81")],
)
def test_data_of_an_unknown_type_is_an_error(kind: int, size: int, name: str) -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    with pytest.raises(LidarError, match=f"type {name} in packets of {size} bytes"):
        session.receive_data(descriptor(size, kind, stream=True), 0)


@given(st.lists(st.integers(0, 60), max_size=8), st.binary(max_size=20))
def test_answers_may_come_in_pieces_and_behind_noise(cuts: list[int], noise: bytes) -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    data = noise.replace(b"\xa5", b"") + info(0x28) + setting(0x71, (25_600).to_bytes(4, "little"))
    places = sorted({min(cut, len(data)) for cut in cuts} | {len(data)})
    for begin, end in zip([0, *places], places, strict=False):
        assert session.receive_data(data[begin:end], 0) == []
    assert session.description.startswith("model 0x28") and session.sample_rate == pytest.approx(10_000.0)


def test_a_damaged_descriptor_hides_no_answer() -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    session.receive_data(descriptor(257, INFO, stream=False) + info(0x28), 0)
    assert session.description.startswith("model 0x28")


@pytest.mark.parametrize("content", [b"", b"\x02", bytes(19), bytes((DAMAGED, 1, 2, 3))])
def test_answers_of_a_wrong_size_change_nothing(content: bytes) -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    for kind in (INFO, HEALTH, 0x20):
        session.receive_data(answer(kind, content if kind != 0x20 else content[:4]), 0)
    session.receive_data(setting(0x71, bytes(4)), 0)
    assert session.description == "" and session.sample_rate == pytest.approx(8000.0)


def group(degrees: float, metres: float = 1.0) -> bytes:
    """Return eight standard samples, one a degree."""
    return b"".join(encode_standard(math.radians(degrees + k), metres, first=False) for k in range(8))


def test_bearings_are_counter_clockwise_from_behind() -> None:
    """Zero of the lidar is its cable's side, as in the maker's driver."""
    (samples,) = started(STANDARD, 5).receive_data(group(90.0, 2.5) + group(98.0), 10**9)
    assert np.degrees(samples.bearings) == pytest.approx(180.0 - (90.0 + np.arange(8)), abs=0.01)
    assert samples.ranges == pytest.approx(2.5)


def test_the_last_sample_is_taken_when_its_packet_begins() -> None:
    session = started(STANDARD, 5, sample_us=500.0)
    (samples,) = session.receive_data(group(0.0) + group(8.0), 10**9)
    began_ns = 10**9 - 80 * 10e9 / BAUD
    assert samples.times_ns[-1] == pytest.approx(began_ns, abs=2)
    assert np.diff(samples.times_ns) == pytest.approx(500_000, abs=1)


def dense(degrees: float, metres: float = 3.0, *, begins: bool = False) -> bytes:
    return encode_dense(math.radians(degrees % 360.0), np.full(40, metres), begins=begins)


def received(*capsules: bytes) -> list[Samples]:
    """Return the samples of dense capsules, with 50 us between two samples, behind which another one begins."""
    return started(DENSE, 84).receive_data(b"".join(capsules) + dense(0.0)[:2], 10**9)


def test_a_capsule_is_decoded_with_the_one_behind_it() -> None:
    first, second = received(dense(350.0, 1.0), dense(358.0, 2.0), dense(6.0, 3.0))
    for samples, start, metres in ((first, 350.0, 1.0), (second, 358.0, 2.0)):
        expected = (180.0 - (start + 0.2 * np.arange(40)) + 180.0) % 360.0 - 180.0
        assert np.degrees(samples.bearings) == pytest.approx(expected)
        assert samples.ranges == pytest.approx(metres)
    began_ns = 10**9 - (3 * 84 + 2) * 10e9 / BAUD
    assert first.times_ns[-1] == pytest.approx(began_ns, abs=2), "of its own packet, not of the next one"
    assert np.diff(first.times_ns) == pytest.approx(50_000, abs=1)


def test_the_first_capsule_of_a_scan_continues_none() -> None:
    found = received(dense(0.0, 1.0), dense(8.0, 2.0, begins=True), dense(16.0, 3.0))
    assert [float(samples.ranges[0]) for samples in found] == [2.0]


def test_a_lost_capsule_costs_the_one_before_it() -> None:
    broken = bytearray(dense(8.0))
    broken[50] ^= 1
    session = started(DENSE, 84)
    stream = [dense(0.0, 1.0), bytes(broken), dense(16.0, 2.0), dense(24.0, 3.0), dense(32.0)[:2]]
    found = session.receive_data(b"".join(stream), 10**9)
    assert [float(samples.ranges[0]) for samples in found] == [2.0] and session.damaged == 1


@pytest.mark.parametrize(("degrees", "plausible"), [(14.0, True), (14.5, False), (359.0, False)])
def test_capsules_too_far_apart_do_not_belong_together(degrees: float, plausible: bool) -> None:
    """At 20 revolutions a second, 40 samples of 50 us are 14.4 degrees."""
    assert len(received(dense(0.0), dense(degrees))) == plausible


def test_a_stream_can_follow_its_descriptor_in_the_same_read() -> None:
    session = RplidarSession(BAUD, SAMPLE_NS)
    talk(session, answers(MODEL["A2"], kind=EXPRESS))
    capsules = [encode_express(math.radians(a), np.full(32, 1.5), begins=False) for a in (0.0, 6.0, 12.0)]
    (samples,) = session.receive_data(descriptor(84, EXPRESS, stream=True) + b"".join(capsules), 10**9)
    assert len(samples.ranges) == 32 and samples.ranges == pytest.approx(1.5)
