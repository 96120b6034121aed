"""The codec: whatever comes over the wire, only what a board sent comes out, once and in order."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tests.devices.session import BITS, MS, ROBOT, motion, opened, sent_lines, speeds, wrapped
from tests.firmware.serial_lines import add_checksum

from chefbot.board import BoardSession, LineSplitter, ReceivedLine, SensorConverter, frame, parse, unframe
from chefbot.board.framing import MAX_LINE_LENGTH
from chefbot.board.messages import BoardLine, MotionLine
from chefbot.maths.clock_sync import ClockSync
from chefbot.maths.counter_unwrap import CounterUnwrapper
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.sensor_msgs import Imu

STEP_US = 10_000


def stream(count: int, first: int = 0) -> list[bytes]:
    """Lines of all kinds, one each control step."""
    kinds = (
        "{t} 5 -7 123 9 0100",
        "{t} 1 -2 3 4 5 9806 2500 1",
        "{t} 2 0000 4138 1485 1370 213 204 0 0 0 0",
        "{t} 5831",
        "{t} 12013",
        "{t} 5 0 0 68",
    )
    return [
        add_checksum(f"{'eisubt'[n % 6]} {(first + n) % 65536} " + kinds[n % 6].format(t=n * STEP_US))
        for n in range(count)
    ]


def lines_in(data: bytes, session: BoardSession | None = None) -> list[BoardLine]:
    session = session or BoardSession(ROBOT)
    return [received.line for received in session.receive_data(data, 0)]


def lines_of(raw: list[bytes]) -> list[BoardLine]:
    found = [parse(line[:-1]) for line in raw]
    assert None not in found
    return [line for line in found if line is not None]


# -- framing


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126)))
def test_framing_round_trips(text: str) -> None:
    assert frame(text) == add_checksum(text)
    assert unframe(frame(text)[:-1]) == text


@given(st.lists(st.binary(max_size=400)))
def test_the_line_splitter_is_bounded_and_independent_of_chunks(chunks: list[bytes]) -> None:
    splitter, whole = LineSplitter(), LineSplitter()
    pieces = [line for chunk in chunks for line in splitter.push(chunk)]
    assert pieces == whole.push(b"".join(chunks))
    assert all(0 < len(line) <= MAX_LINE_LENGTH for line in pieces)
    assert len(splitter._part) <= MAX_LINE_LENGTH


@given(st.binary(max_size=300))
def test_random_bytes_are_not_lines(data: bytes) -> None:
    session = BoardSession(ROBOT)
    assert session.receive_data(data + b"\n", 0) == []
    assert not session.is_open and session.silent(0)


@given(
    st.text("v0123456789 -", max_size=60) | st.text("eisubt0123456789ABCDEF -*", max_size=80),
    st.integers(0, 9),
)
def test_a_valid_crc_alone_is_not_a_line(text: str, sequence: int) -> None:
    """A line with a valid CRC is parsed to values that fit their fields, or not at all."""
    line = parse(add_checksum(text)[:-1])
    if line is not None:
        assert 0 <= line.sequence < 65536
        assert getattr(line, "t", 0) < BITS


def test_every_message_type_is_parsed() -> None:
    names = [type(line).__name__ for line in lines_of(stream(6))]
    assert names == ["MotionLine", "InertiaLine", "StatusLine", "EchoLine", "BatteryLine", "UptimeLine"]
    answer = "v 37 7 chefbot 1 host 5C093193 8400000 100 1000 10909 10399 10695 14854 4136 03"
    other = "v 37 7 chefbot 2 host whatever comes then"
    assert [type(parse(add_checksum(text)[:-1])).__name__ for text in (answer, other)] == [
        "VersionLine",
        "UnsupportedVersionLine",
    ]


# -- damage

LINES = 40


@st.composite
def damage(draw: st.DrawFn) -> tuple[list[bytes], int]:
    """A stream with some of its lines damaged, lost, repeated or cut; and behind which line all is well again."""
    lines = stream(LINES, first=draw(st.sampled_from([0, 65520, 1000])))
    hurt = draw(st.sets(st.integers(0, LINES - 12), max_size=12))
    for number in hurt:
        line = lines[number]
        kind = draw(st.sampled_from(["flip", "lose", "repeat", "cut", "garbage", "no end"]))
        if kind == "flip":
            whole = bytearray(line)
            for bit in draw(st.sets(st.integers(0, 8 * len(line) - 1), min_size=1, max_size=3)):
                whole[bit // 8] ^= 1 << (bit % 8)
            line = bytes(whole)
        elif kind == "cut":
            line = line[: draw(st.integers(0, len(line) - 1))]
        lines[number] = {
            "lose": b"",
            "repeat": line * 2,
            "garbage": draw(st.binary(max_size=200)) + line,
            "no end": line[:-1],
        }.get(kind, line)
    return lines, max(hurt, default=-1)


@settings(max_examples=300)
@given(damage(), st.integers(1, 50))
@pytest.mark.slow
def test_only_intact_lines_are_read_from_a_damaged_stream(hurt: tuple[list[bytes], int], chunk: int) -> None:
    """In order, none twice, and all of them again from the second line behind the damage on."""
    lines, last = hurt
    first = parse(stream(1, 0)[0][:-1])
    assert first is not None
    original = [parse(raw[:-1]) for raw in _unhurt(lines)]
    data = b"".join(lines)
    session = BoardSession(ROBOT)
    received: list[ReceivedLine] = []
    for at in range(0, len(data), chunk):
        received += session.receive_data(data[at : at + chunk], 0)
    numbers = [original.index(one.line) for one in received]
    assert numbers == sorted(set(numbers))
    assert set(range(last + 2, LINES)) <= set(numbers)


def _unhurt(lines: list[bytes]) -> list[bytes]:
    """The stream before the damage: its last line, never hurt, shows where it began."""
    line = parse(lines[-1][:-1])
    assert line is not None
    return stream(LINES, first=(line.sequence - LINES + 1) % 65536)


@given(st.lists(st.integers(0, 30), min_size=1, max_size=60))
@example([0, 26, 27])
def test_reordered_lines_are_not_delivered_twice_or_late(order: list[int]) -> None:
    lines = stream(31)
    session = BoardSession(ROBOT)
    numbers = [received.line.sequence for n in order for received in session.receive_data(lines[n], 0)]
    assert numbers == sorted(set(numbers))
    assert session.stream.restarts == 0


@pytest.mark.parametrize(("uptime", "skipped"), [(100_000_000, 1), (0, 19)])
def test_a_board_restart_is_detected(uptime: int, skipped: int) -> None:
    """At once where its time shows it; where it was just switched on, repeated lines must be distinguished first."""
    session, sensors = BoardSession(ROBOT), SensorConverter(ROBOT)
    for n in range(50):
        for received in session.receive_data(motion(n, uptime + n * STEP_US, left=90 * n), n * 10 * MS):
            sensors.messages(received)
    now = 60 * 10 * MS
    again = [
        h for n in range(40) for h in session.receive_data(motion(n, n * STEP_US, left=n), now + n * 10 * MS)
    ]
    assert [received.line.sequence for received in again] == list(range(skipped, 40))
    assert [received.restarted for received in again] == [True] + [False] * (39 - skipped)
    assert session.stream.restarts == 1
    ticks = [m for received in again for m in sensors.messages(received) if isinstance(m, WheelTicks)]
    assert [m.left for m in ticks] == list(range(skipped, 40))


@given(st.integers(1, 5000), st.integers(0, 65535), st.integers(0, BITS - 1), st.integers(0, 900 * MS))
def test_lost_lines_are_not_a_restart(lost: int, first: int, uptime: int, late_ns: int) -> None:
    """However many were lost, and however late the computer read the one before them."""
    session = BoardSession(ROBOT)
    numbers = (0, 1, lost + 2, lost + 3)
    arrival_ns = (late_ns, late_ns, *(max(late_ns, n * STEP_US * 1000) for n in numbers[2:]))
    for n, now in zip(numbers, arrival_ns, strict=True):
        assert session.receive_data(motion(first + n, uptime + n * STEP_US), now)
    assert session.stream.restarts == 0 and session.stream.lost == lost


# -- wraps


@given(st.integers(-(2**40), 2**40), st.lists(st.integers(-(2**31) + 1, 2**31 - 1), max_size=30))
def test_a_wrapped_sequence_number_continues(start: int, steps: list[int]) -> None:
    counter, true = CounterUnwrapper(), wrapped(start)
    assert counter.update(wrapped(start)) == true
    for step in steps:
        true += step
        assert counter.update(true % BITS) == true
        assert counter.update(wrapped(true)) == true


@given(
    st.integers(0, BITS - 1), st.lists(st.tuples(st.integers(1, 10**8), st.integers(0, 10**6)), max_size=20)
)
def test_the_board_clock_continues_over_its_wrap(start: int, steps: list[tuple[int, int]]) -> None:
    """Steps in us, delays in ns: stamps are never in the future, nor later than the true time plus a delay."""
    clock = ClockSync(start, 0)
    now, board = 0, start
    for step_us, delay_ns in steps:
        now, board = now + step_us * 1000, board + step_us
        full = clock.unwrap(board % BITS, now + delay_ns)
        assert full == board
        assert (
            now <= clock.stamp(full, now + delay_ns) + 1_000_000 and clock.delay_ns(full, now + delay_ns) >= 0
        )


@given(st.lists(st.tuples(st.integers(1, 10**6), st.integers(0, 10**9)), min_size=2, max_size=30))
def test_stamps_are_monotonic_for_any_line_delay(steps: list[tuple[int, int]]) -> None:
    """Steps in us; delays in ns, up to a second as on a computer that is busy starting."""
    now = board = 0
    clock, stamps = ClockSync(0, 10**9), [10**9]
    for step_us, delay_ns in steps:
        now, board = now + step_us * 1000, board + step_us
        stamps.append(clock.stamp(board, max(now + delay_ns, stamps[-1])))
        assert stamps[-1] - stamps[-2] >= step_us * 500


@given(
    st.integers(BITS - 40 * STEP_US, BITS),
    st.integers(-(2**33), 2**33),
    st.integers(-150, 150),
    st.integers(-8_000_000, 8_000_000),
    st.sets(st.integers(1, 58), max_size=40),
)
def test_ticks_and_yaw_survive_wraps_and_lost_lines(
    t: int, start: int, speed: int, rate: int, lost: set[int]
) -> None:
    """speed: ticks per step; rate: 1e-8 rad per step."""
    session, sensors = BoardSession(ROBOT), SensorConverter(ROBOT)
    ticks: list[WheelTicks] = []
    turned, before = 0.0, 0
    for n in (n for n in range(60) if n not in lost):
        line = motion(n, t + n * STEP_US, start + speed * n, start - speed * n, start + rate * n, n)
        for received in session.receive_data(line, n * 10 * MS):
            for message in sensors.messages(received):
                if isinstance(message, WheelTicks):
                    ticks.append(message)
                elif isinstance(message, Imu):
                    turned += message.angular_velocity.z * (n - before) * 0.01
            before = n
    assert ticks[-1].left - ticks[0].left == speed * 59
    assert ticks[-1].right - ticks[0].right == -speed * 59
    assert math.isclose(turned, rate * 59e-8, abs_tol=1e-9)
    assert session.stream.lost == len(lost) and session.stream.restarts == 0


def test_no_imu_message_spans_missing_gyro_samples() -> None:
    session, sensors = BoardSession(ROBOT), SensorConverter(ROBOT)
    samples = [0, 1, 2, 2, 3, 4]
    is_imu = [
        isinstance(message, Imu)
        for n, count in enumerate(samples)
        for received in session.receive_data(motion(n, n * STEP_US, samples=count), n * 10 * MS)
        for message in sensors.messages(received)
    ]
    assert is_imu.count(True) == 4  # five gaps, one without its sample


# -- what we send


def test_only_handshakes_are_sent_before_an_answer() -> None:
    session = BoardSession(ROBOT)
    sent = b"".join(
        session.data_to_send(n * 20 * MS) + session.command(4.0, 4.0, n * 20 * MS) for n in range(100)
    )
    assert {fields[0] for fields in sent_lines(sent)} == {"v"}


@given(st.sampled_from([math.nan, math.inf, -math.inf]), st.booleans())
def test_speeds_that_are_not_finite_are_not_sent(bad: float, left: bool) -> None:
    session = opened()
    assert session.command(bad if left else 0.1, 0.1 if left else bad, 1001 * MS) == b""
    assert speeds(session.data_to_send(1060 * MS)) == []


@given(st.lists(st.tuples(st.floats(-40.0, 40.0), st.integers(1, 400)), min_size=1, max_size=30))
def test_an_expired_speed_is_not_repeated(commands: list[tuple[float, int]]) -> None:
    """Whatever pauses upstream makes: 40 ms after its last command no speed is sent."""
    session, now = opened(), 1000
    for speed, pause in commands:
        now += pause
        session.receive_data(motion(now % 65536, now * 1000), now * MS)
        ticks = round(speed * ROBOT.motor.ticks_per_radian)
        assert speeds(session.command(speed, speed, now * MS)) == [(ticks, ticks)]
        for age in range(10, 300, 10):
            sent = speeds(session.data_to_send((now + age) * MS))
            assert sent == ([(ticks, ticks)] if age < 40 else [])
        now += 300


@given(st.lists(st.floats(-1e300, 1e300), min_size=1, max_size=20), st.integers(0, 65535))
def test_every_command_fits_the_protocol(values: list[float], first: int) -> None:
    """At most nine digits, numbers one ahead of each other modulo 2^16."""
    session, expected = opened(first), first
    for n, value in enumerate(values, start=1):
        for fields in sent_lines(session.command(value, -value, (1000 + n) * MS)):
            assert all(len(field.lstrip("-")) <= 9 for field in fields[1:])
            assert int(fields[1]) == (expected + 1 + n) % 65536  # one stop was sent before


def test_after_a_clear_motion_needs_a_zero_command() -> None:
    session = opened()
    session.clear(1100 * MS)
    sent = b""
    for n in range(30):
        sent += session.data_to_send((1100 + 20 * n) * MS) + session.command(4.0, 4.0, (1110 + 20 * n) * MS)
    assert set(speeds(sent)) == {(0, 0)}
    assert "c" in {fields[0] for fields in sent_lines(sent)}
    session.receive_data(motion(2, 1_800_000), 1800 * MS)
    session.command(0.0, 0.0, 1800 * MS)
    assert speeds(session.command(4.0, 4.0, 1820 * MS))[0][0] > 0


def test_stale_ticks_of_the_board_turn_commands_into_stops() -> None:
    session = opened()
    ticks = round(4.0 * ROBOT.motor.ticks_per_radian)
    assert not session.ticks_stale(1250 * MS) and speeds(session.command(4.0, 4.0, 1250 * MS)) == [
        (ticks, ticks)
    ]
    assert session.ticks_stale(1260 * MS) and speeds(session.command(4.0, 4.0, 1260 * MS)) == [(0, 0)]
    session.receive_data(motion(2, 1_300_000), 1300 * MS)
    assert speeds(session.command(4.0, 4.0, 1300 * MS)) == [(ticks, ticks)]


def test_emergency_stop_is_sent_until_the_board_confirms() -> None:
    session = opened()
    sent = [session.stop(1100 * MS)] + [session.data_to_send((1100 + 20 * n) * MS) for n in range(1, 30)]
    assert all("x" in {fields[0] for fields in sent_lines(data)} for data in sent)
    session.receive_data(add_checksum("e 2 1700000 0 0 0 0 0302"), 1700 * MS)
    later = b"".join(session.data_to_send((1710 + 20 * n) * MS) for n in range(10))
    assert "x" not in {fields[0] for fields in sent_lines(later)}


def test_a_board_with_other_version_or_ticks_is_refused() -> None:
    for answer, word in (
        ("chefbot 2 future", "version 2"),
        ("chefbot 1 test 00000000 8400000 100 1000 9000 9000 9000 9000 7 03", "8400 ticks per turn"),
    ):
        session = BoardSession(ROBOT)
        (hello,) = sent_lines(session.data_to_send(0))
        session.receive_data(add_checksum(f"v 0 {hello[1]} {answer}"), 0)
        assert not session.is_open
        assert (
            session.refused is not None
            and word in session.refused
            and "chefbot board flash" in session.refused
        )
        assert session.command(0.1, 0.1, 20 * MS) == b""


def test_an_answer_to_another_handshake_is_ignored() -> None:
    session = BoardSession(ROBOT)
    session.data_to_send(0)
    ticks = round(1000 * ROBOT.motor.ticks_per_turn)
    session.receive_data(add_checksum(f"v 0 77777 chefbot 1 test 00000000 {ticks} 100 1000 9 9 9 9 7 03"), 0)
    assert not session.is_open


def test_motion_lines_are_parsed_with_types() -> None:
    (line,) = lines_in(motion(3, 20_000, -5, 6, -7, 2))
    assert line == MotionLine(3, 20_000, -5, 6, -7, 2, 0)
