"""Motor drives with a controller of their own: the same contract for each, on emulators of their bytes."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.motor_drives import EMULATORS, ROBOT, EmulatedDdsm115, EmulatedRoboClaw

from chefbot.board.drives import ddsm115, roboclaw
from chefbot.board.drives.drive_link import MAX_UNATTENDED_SPEED, DriveLink
from chefbot.board.drives.drives import DRIVES
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import BatteryState
from chefbot.robot.drivetrain import DRIVE_PROTOCOLS

STEP_NS = 2_000_000
"""Time of a step of the bench: an answer takes one."""
SLOW_WHEEL = MAX_UNATTENDED_SPEED / ROBOT.wheel_radius
"""rad/s"""


class DriveBench:
    """Link and emulated drive; each answer arrives a step after its request, unless the line is cut."""

    def __init__(self, protocol: str) -> None:
        self.drive: Any = EMULATORS[protocol]()
        self.link: DriveLink = DRIVES[protocol].link(ROBOT)
        self.now, self.messages, self.cut = 0, list[Message](), False
        self._answer = b""

    def run(self, seconds: float, speed: float | None = None, turn: float = 0.0) -> None:
        for step in range(round(seconds * 1e9 / STEP_NS)):
            self.now += STEP_NS
            self.drive.turn(STEP_NS / 1e9)
            self._send(self._receive())
            if speed is not None and step % 10 == 0:
                self._send(self.link.command(speed - turn, speed + turn, self.now))
            self._send(self.link.data_to_send(self.now))

    def _receive(self) -> bytes:
        answer, self._answer = self._answer, b""
        if answer and not self.cut:
            self.messages += self.link.receive_data(answer, self.now)
        return b""

    def _send(self, data: bytes) -> None:
        if data and not self.cut:
            self._answer += self.drive.receive(data)

    @property
    def ticks(self) -> list[WheelTicks]:
        return [message for message in self.messages if isinstance(message, WheelTicks)]

    @property
    def speeds(self) -> list[float]:
        return list(self.drive.motors.speed)


@pytest.fixture(params=DRIVE_PROTOCOLS)
def bench(request: pytest.FixtureRequest) -> DriveBench:
    return DriveBench(request.param)


def test_each_protocol_of_the_robot_file_has_a_drive() -> None:
    assert set(DRIVES) == set(DRIVE_PROTOCOLS) == set(EMULATORS)


def test_wheels_turn_as_commanded_and_ticks_follow(bench: DriveBench) -> None:
    bench.run(0.5, 0.0)
    assert bench.link.is_open and bench.link.report("port", bench.now).level in (OK, WARN)
    bench.run(1.0, 1.5, turn=0.5)
    assert bench.speeds == pytest.approx([1.0, 2.0], abs=0.06)  # a DDSM115 takes whole turns a minute
    first, angles = bench.ticks[-1], list(bench.drive.motors.angle)
    bench.run(1.0, 1.5, turn=0.5)
    for wheel, name in enumerate(("left", "right")):
        moved = bench.drive.motors.angle[wheel] - angles[wheel]
        ticks = getattr(bench.ticks[-1], name) - getattr(first, name)
        assert ticks / ROBOT.motor.ticks_per_radian == pytest.approx(moved, abs=0.1)
    stamps = [ticks.header.stamp.ns for ticks in bench.ticks]
    assert stamps == sorted(set(stamps)) and len(bench.ticks) >= 2.4 * 25


def test_backwards_ticks_count_down(bench: DriveBench) -> None:
    bench.run(0.5, 0.0)
    bench.run(1.0, -2.0)
    assert max(bench.speeds) < -1.5 and bench.ticks[-1].left < 0 and bench.ticks[-1].right < 0


def test_the_first_motion_needs_a_stop(bench: DriveBench) -> None:
    bench.run(0.5, 2.0)
    assert max(map(abs, bench.speeds)) < 1e-6
    bench.run(0.2, 0.0)
    bench.run(0.5, 2.0)
    assert min(bench.speeds) > 1.0


def test_missing_commands_stop_the_wheels(bench: DriveBench) -> None:
    bench.run(0.3, 0.0)
    bench.run(0.5, 2.0)
    bench.run(0.8)
    assert max(map(abs, bench.speeds)) < 0.05


def test_an_emergency_stop_is_latched_until_cleared_and_neutral(bench: DriveBench) -> None:
    bench.run(0.3, 0.0)
    bench.run(0.5, 2.0)
    bench.link.stop(bench.now)
    bench.run(0.8, 2.0)
    assert max(map(abs, bench.speeds)) < 0.05
    bench.link.clear(bench.now)
    bench.run(0.5, 2.0)
    assert max(map(abs, bench.speeds)) < 0.05
    bench.run(0.2, 0.0)
    bench.run(0.5, 2.0)
    assert min(bench.speeds) > 1.0


def test_a_drive_that_does_not_answer_is_reported(bench: DriveBench) -> None:
    bench.run(0.3, 0.0)
    bench.run(0.5, 2.0)
    bench.cut = True
    bench.run(0.6, 2.0)
    report = bench.link.report("port", bench.now)
    assert report.level == ERROR and "does not answer" in report.message
    assert bench.link.speeds(bench.now) == (0.0, 0.0)
    bench.cut = False
    bench.run(0.5, 0.0)
    assert bench.link.report("port", bench.now).level in (OK, WARN) and bench.link.line.lost > 0


@pytest.mark.parametrize("protocol", DRIVE_PROTOCOLS)
@given(st.lists(st.binary(min_size=1, max_size=30), max_size=8))
def test_noise_on_the_line_moves_no_counter_far(protocol: str, noise: list[bytes]) -> None:
    bench = DriveBench(protocol)
    bench.run(0.3, 0.0)
    for part in noise:
        bench._answer += part
        bench.run(0.1, 0.0)
    bench.run(0.4, 0.0)
    assert abs(bench.ticks[-1].left) <= 1 and abs(bench.ticks[-1].right) <= 1
    assert bench.link.report("port", bench.now).level in (OK, WARN)


def test_the_wheels_of_a_drive_without_a_watchdog_turn_slowly() -> None:
    bench = DriveBench("ddsm115")
    bench.run(0.3, 0.0)
    bench.run(1.5, 20.0)
    assert max(bench.speeds) == pytest.approx(SLOW_WHEEL, abs=0.1)
    assert bench.link.notice == ddsm115.NO_WATCHDOG


@pytest.mark.parametrize(("knows_timeout", "slow"), [(True, False), (False, True)])
def test_a_roboclaw_is_fast_once_it_stops_by_itself(knows_timeout: bool, slow: bool) -> None:
    bench = DriveBench("roboclaw")
    drive: EmulatedRoboClaw = bench.drive
    drive.knows_timeout = knows_timeout
    bench.run(0.5, 0.0)
    assert (bench.link.notice == roboclaw.NO_TIMEOUT) == slow
    bench.run(1.5, 2.0 * SLOW_WHEEL)
    assert (bench.speeds[0] < 1.1 * SLOW_WHEEL) == slow
    bench.cut = True  # the computer fails
    bench.run(1.0)
    assert (bench.speeds[0] < 0.05) == knows_timeout


def test_a_roboclaw_that_is_not_tuned_is_refused() -> None:
    bench = DriveBench("roboclaw")
    bench.drive.qpps = 0
    bench.run(0.3, 0.0)
    assert bench.link.refused == roboclaw.UNTUNED


def test_a_roboclaw_of_another_motor_is_named() -> None:
    bench = DriveBench("roboclaw")
    bench.drive.qpps *= 2
    bench.run(0.3, 0.0)
    assert bench.link.refused is None and "counts/s at full speed" in str(bench.link.notice)


def test_battery_version_and_faults_of_a_roboclaw() -> None:
    bench = DriveBench("roboclaw")
    bench.run(3.0, 0.0)
    battery = [one for one in bench.messages if isinstance(one, BatteryState)]
    assert battery[-1].voltage == pytest.approx(12.3)
    assert bench.link.details["version"] == "USB Roboclaw 2x15a v4.2.4" and bench.link.fault == ""
    bench.drive.status = 0x0041
    bench.run(0.5, 0.0)
    assert "emergency stop input" in bench.link.fault and "driver of motor 1" in bench.link.fault


def test_a_blocked_ddsm115_is_named() -> None:
    bench = DriveBench("ddsm115")
    drive: EmulatedDdsm115 = bench.drive
    drive.errors[1] = 0x08
    bench.run(0.3, 0.0)
    assert bench.link.fault == "The right motor has stopped: it is blocked."
    assert drive.mode == [ddsm115.VELOCITY_MODE] * 2


def test_frames_of_the_makers() -> None:
    """Waveshare's example for -50 turns a minute; Basicmicro's CRC is that of XMODEM."""
    assert ddsm115.speed_frame(1, -50) == bytes.fromhex("0164ffce0000000000da")
    assert roboclaw.crc16(b"123456789") == bytes.fromhex("31c3")


def test_a_drive_that_restarts_continues_its_ticks() -> None:
    bench = DriveBench("roboclaw")
    bench.run(0.3, 0.0)
    bench.run(0.5, 2.0)
    before = bench.ticks[-1]
    bench.drive._offset = -bench.drive.counts(0) + 4_294_960_000  # its counters begin at another number
    bench.run(0.1, 2.0)
    bench.run(0.4, 2.0)
    moved = bench.ticks[-1].left - before.left
    assert 0 < moved < 2.0 * 0.6 * ROBOT.motor.ticks_per_radian
