"""The session with a board, its diagnostics, and the text and messages made of its lines."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.firmware.serial_lines import add_checksum

from chefbot.board.compatibility import LIMITS, constant_differences, incompatibility
from chefbot.board.firmware_constants import firmware_constants
from chefbot.board.framing import unframe
from chefbot.board.link import BoardLink
from chefbot.board.link_health import NEUTRAL_REQUIRED, TICKS_STALE, LinkDiagnostics
from chefbot.board.messages import (
    NO_ECHO,
    NO_SENSOR,
    BatteryLine,
    EchoLine,
    InertiaLine,
    MotionLine,
    StatusLine,
    UnsupportedVersionLine,
    UptimeLine,
    VersionLine,
)
from chefbot.board.pretty_print import describe, flags
from chefbot.board.sensors import SPEED_OF_SOUND, SensorConverter, battery_state, range_message
from chefbot.board.sequence_filter import ReceivedLine
from chefbot.board.session import COMMAND_TIMEOUT_NS, HANDSHAKE_NS, HEARTBEAT_NS, REPEAT_NS, BoardSession
from chefbot.board.status_codes import FAULT_LATCHED, FAULTS, WARNINGS, BoardFlag
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN
from chefbot.msgs.sensor_msgs import Imu, Range
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
CONSTANTS = {constant.name: constant.value for constant in firmware_constants(ROBOT)}
MS = 1_000_000


def version(**changes: Any) -> VersionLine:
    values: dict[str, Any] = {
        "sequence": 0, "token": 1, "name": "chefbot", "protocol": 1, "port": "test", "hash": CONSTANTS["hash"],
        "ticks_per_turn_milli": CONSTANTS["ticks_per_turn_milli"], "control_rate": 100, "duty_full": 1000,
        **{name: CONSTANTS[name] for name in LIMITS}, "first": 7, "sensors": 3,
    }  # fmt: skip
    return VersionLine(**{**values, **changes})


def answer(token: str, first: int = 7) -> bytes:
    limits = " ".join(str(CONSTANTS[name]) for name in LIMITS)
    ticks, digest = CONSTANTS["ticks_per_turn_milli"], CONSTANTS["hash"] % (1 << 32)
    return add_checksum(f"v 0 {token} chefbot 1 test {digest:08X} {ticks} 100 1000 {limits} {first} 03")


def motion(number: int, now_ns: int, flags: int = 0) -> bytes:
    return add_checksum(f"e {number} {now_ns // 1000} 0 0 0 0 {flags:04X}")


def fields(data: bytes) -> list[list[str]]:
    return [(unframe(line) or "").split() for line in data.split(b"\n") if line]


def opened(now_ns: int = 0) -> BoardSession:
    session = BoardSession(ROBOT)
    (hello,) = fields(session.data_to_send(now_ns))
    session.receive_data(answer(hello[1]) + motion(1, now_ns), now_ns)
    assert session.is_open
    return session


def speeds(data: bytes) -> list[tuple[int, int]]:
    return [(int(line[2]), int(line[3])) for line in fields(data) if line[0] == "s"]


def test_handshakes_are_repeated_until_answered() -> None:
    session = BoardSession(ROBOT)
    sent = [session.data_to_send(n * REPEAT_NS) for n in range(100)]
    assert len([data for data in sent if data]) == 100 * REPEAT_NS // HANDSHAKE_NS
    assert session.receive_data(answer("9999"), 2000 * MS) and not session.is_open, "of another program"


def test_the_first_motion_needs_a_stop_and_old_commands_expire() -> None:
    session = opened()
    assert speeds(session.command(0.2, 0.2, 0)) == [(0, 0)] and session.waiting_for_stop(MS)
    session.command(0.0, 0.0, MS)
    ticks = round(0.2 * ROBOT.motor.ticks_per_radian)
    assert speeds(session.command(0.2, -0.2, 2 * MS)) == [(ticks, -ticks)]
    assert speeds(session.data_to_send(2 * MS + COMMAND_TIMEOUT_NS - 1)) == [(ticks, -ticks)]
    assert speeds(session.data_to_send(2 * MS + COMMAND_TIMEOUT_NS)) == []
    assert session.command(math.nan, 0.0, 60 * MS) == b""


def test_an_idle_session_sends_heartbeats() -> None:
    session = opened()
    kinds = []
    for n in range(1, 51):
        session.receive_data(motion(n + 1, n * REPEAT_NS), n * REPEAT_NS)
        kinds += [line[0] for line in fields(session.data_to_send(n * REPEAT_NS))]
    assert set(kinds) == {"h"} and len(kinds) == pytest.approx(50 * REPEAT_NS / HEARTBEAT_NS, abs=1)


def test_sequence_numbers_continue_those_of_the_handshake() -> None:
    session = opened()
    sent = b"".join(session.command(0.0, 0.0, n * MS) for n in range(5))
    assert [int(line[1]) for line in fields(sent)] == list(range(8, 13))


def test_a_closed_session_needs_a_new_handshake() -> None:
    session = opened()
    session.receive_data(motion(2, 200 * MS, BoardFlag.NO_SESSION), 200 * MS)
    assert not session.is_open
    session = opened()
    session.connection_lost()
    assert not session.is_open and session.neutral_first


@pytest.mark.parametrize(("driver", "flag"), [("", BoardFlag.IMU_BAD), ("bno085_rvc", 0)])
def test_a_board_without_imu_beside_another_one_is_not_a_fault(driver: str, flag: int) -> None:
    imu = msgspec.structs.replace(ROBOT.sensors.imu, driver=driver)
    sensors = msgspec.structs.replace(ROBOT.sensors, imu=imu)
    session = BoardSession(msgspec.structs.replace(ROBOT, sensors=sensors))
    session.receive_data(motion(1, 1000, BoardFlag.IMU_BAD), 1000)
    assert session.flags == flag


def test_changed_limits_of_a_compatible_board_are_named() -> None:
    assert incompatibility(version(), ROBOT) is None and constant_differences(version(), ROBOT) is None
    changed = constant_differences(version(hash=1, max_turn=3), ROBOT)
    assert changed and "max_turn 3 instead of" in changed and "max_wheel" not in changed
    assert "ticks per turn" in (incompatibility(version(ticks_per_turn_milli=5), ROBOT) or "")
    assert "version 2" in (incompatibility(UnsupportedVersionLine(0, 0, 2), ROBOT) or "")


def status(flags: int = 0, refused: int = 0, reason: int = 0) -> StatusLine:
    return StatusLine(0, 0, 2, flags, 0, 100, 100, 10, 10, refused, reason, 0, 0)


def test_diagnostics_report_silence_faults_and_warnings() -> None:
    health, session = LinkDiagnostics(), BoardSession(ROBOT)
    assert health.report(session, "port", 0).level == ERROR
    session = opened()
    report = health.report(session, "port", MS)
    assert (report.level, report.message) == (OK, "The board is OK.")
    session.command(0.1, 0.1, MS)
    report = health.report(session, "port", 2 * MS)
    assert report.level == WARN and NEUTRAL_REQUIRED[1:] in report.message
    assert TICKS_STALE[1:] in health.report(session, "port", 900 * MS).message
    session.receive_data(motion(2, 901 * MS, BoardFlag.STALL_LEFT), 901 * MS)
    report = health.report(session, "port", 902 * MS)
    assert report.level == ERROR and "left wheel is blocked" in report.message


@pytest.mark.parametrize("stopped", [0, BoardFlag.ESTOP_COMMAND])
def test_the_fault_that_keeps_the_motors_off_has_its_remedy(stopped: int) -> None:
    link = BoardLink(ROBOT)
    link.receive_data(motion(1, 0, stopped | BoardFlag.BATTERY_LOW), 0)
    assert link.fault == "", "neither a stop by the computer nor a warning is a fault"
    link.receive_data(motion(2, MS, stopped | BoardFlag.ENCODER_LEFT), MS)
    silent = "The left encoder is silent or counts against the motor."
    assert link.fault == f"{silent} The motors are off; press STOP, then Release STOP, to clear it."
    link.receive_data(motion(3, 2 * MS, stopped), 2 * MS)
    assert link.fault == ""


@pytest.mark.parametrize(
    ("identity", "text"),
    [
        (0, "No IMU answers"),
        (0xEA, "id 0xEA has not the registers"),
        (0x70, "MPU-6500 (id 0x70), is stuck"),
    ],
)
def test_an_unused_imu_is_named_by_its_chip(identity: int, text: str) -> None:
    health, session = LinkDiagnostics(), opened()
    session.receive_data(motion(9, MS, BoardFlag.IMU_BAD), MS)
    health.update(UptimeLine(0, 0, 5, 0, 0, identity), MS)
    assert text in health.report(session, "port", MS).message


def test_a_refused_line_is_reported_for_a_limited_time() -> None:
    health, session = LinkDiagnostics(), opened()
    health.update(status(), 0)
    health.update(status(refused=1, reason=2), MS)
    health.update(UptimeLine(0, 0, 5, 1, 2, 0x70), MS)
    report = health.report(session, "port", 2 * MS)
    assert "its form was wrong" in report.message
    assert {value.key: value.value for value in report.values}["lines dropped (buffer full)"] == "1"
    session.receive_data(motion(2, 3100 * MS), 3100 * MS)
    assert health.report(session, "port", 3100 * MS).level == OK


def test_a_refusal_for_a_latched_fault_is_not_another_fault() -> None:
    """After the release nothing is wrong any more; while it is latched, the fault itself is reported."""
    health, session = LinkDiagnostics(), opened()
    health.update(status(), 0)
    session.receive_data(motion(2, MS, BoardFlag.ESTOP_COMMAND), MS)
    health.update(status(BoardFlag.ESTOP_COMMAND, refused=3, reason=FAULT_LATCHED), MS)
    report = health.report(session, "port", 2 * MS)
    assert report.level == ERROR and "refused" not in report.message
    session.receive_data(motion(3, 3 * MS), 3 * MS)
    health.update(status(refused=3, reason=FAULT_LATCHED), 3 * MS)
    assert health.report(session, "port", 4 * MS).level == OK


@given(st.integers(0, 0xFFFF))
def test_every_set_flag_is_described(value: int) -> None:
    text = flags(value)
    assert text.startswith(f"flags {value:04X}")
    for flag, sentence in {**FAULTS, **WARNINGS}.items():
        assert (sentence in text) == bool(value & flag)


def test_every_line_is_described_in_si_units() -> None:
    lines = {
        version(): "protocol 1", UnsupportedVersionLine(0, 1, 9): "protocol 9",
        MotionLine(0, 0, 5, -6, 100_000_000, 3, 0): "angle 1.00000 rad",
        InertiaLine(0, 0, 1_000_000, 0, 0, 0, 0, 9806, 2500, 0): "+9.806 m/s^2",
        status(): "set 100 100 ticks/s", EchoLine(0, 0, NO_ECHO): "no echo",
        EchoLine(0, 0, NO_SENSOR): "no sensor", BatteryLine(0, 0, 12013): "12.01 V",
        UptimeLine(0, 0, 60, 0, 0, 0x68): "up 60 s",
    }  # fmt: skip
    for line, part in lines.items():
        assert part in describe(line)[1]


def received(line: Any, stamp_ns: int, board_us: int, restarted: bool = False) -> ReceivedLine:
    return ReceivedLine(line, stamp_ns, board_us, restarted)


@given(st.lists(st.integers(-40_000, 40_000), min_size=1, max_size=20))
def test_rates_integrate_to_the_angle_of_the_board(angles: list[int]) -> None:
    converter, total, turned = SensorConverter(ROBOT), 0, 0.0
    converter.messages(received(MotionLine(0, 0, 0, 0, 0, 0, 0), 0, 0))
    for n, angle in enumerate(angles, 1):
        total += angle
        line = MotionLine(n, n * 10_000, n, -n, total, n, 0)
        imu, ticks = converter.messages(received(line, n * 10 * MS, n * 10_000))
        assert isinstance(imu, Imu) and isinstance(ticks, WheelTicks)
        assert (ticks.left, ticks.right) == (n, -n)
        turned += imu.angular_velocity.z * 0.01
    assert turned == pytest.approx(total * 1e-8, abs=1e-12)


def test_an_acceleration_is_published_once() -> None:
    converter = SensorConverter(ROBOT)
    converter.messages(received(MotionLine(0, 0, 0, 0, 0, 0, 0), 0, 0))
    converter.messages(received(InertiaLine(1, 0, 1, 2, 3, 0, 0, 9806, 2500, 0), 0, 0))
    found = [
        converter.messages(received(MotionLine(n, n * 10_000, 0, 0, 0, n, 0), n * 10 * MS, n * 10_000))[0]
        for n in (1, 2)
    ]
    assert [one.linear_acceleration.z for one in found if isinstance(one, Imu)] == pytest.approx([9.806, 0.0])
    assert [one.linear_acceleration_covariance[0] < 0 for one in found if isinstance(one, Imu)] == [
        False,
        True,
    ]


@given(st.floats(0.0, 10.0))
def test_ranges_outside_the_limits_are_infinite(distance: float) -> None:
    sonar = ROBOT.sensors.ultrasonic
    assert sonar is not None
    measured = range_message(0, distance, ROBOT).range
    if sonar.range_min <= distance <= sonar.range_max:
        assert measured == pytest.approx(distance, rel=1e-6)
    else:
        assert measured == math.copysign(math.inf, distance - sonar.range_min)


def test_an_echo_is_half_the_path_of_sound() -> None:
    (message,) = SensorConverter(ROBOT).messages(received(EchoLine(0, 0, 5831), 0, 0))
    assert isinstance(message, Range)
    assert message.range == pytest.approx(5831e-6 * SPEED_OF_SOUND / 2, rel=1e-6)
    assert SensorConverter(ROBOT).messages(received(EchoLine(0, 0, NO_SENSOR), 0, 0)) == []


@given(st.floats(0.0, 100.0))
def test_the_charge_is_linear_in_the_voltage_and_bounded(voltage: float) -> None:
    battery = ROBOT.battery
    share = (voltage - battery.empty_voltage) / (battery.full_voltage - battery.empty_voltage)
    assert battery_state(0, voltage, ROBOT).percentage == pytest.approx(min(1.0, max(0.0, share)), abs=1e-6)
