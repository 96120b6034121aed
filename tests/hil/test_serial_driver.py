"""Tests the driver with the Mega's program in simavr over a pseudo-terminal, with simulated wheels."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from chefbot.board.messages import StatusLine, VersionLine
from chefbot.board.status_codes import BoardFlag, BoardState
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.sensor_msgs import BatteryState, Imu, Range
from tests.devices.driven import Driven, clear_faults, drive, push, ready, standing
from tests.devices.emulated import Cable
from tests.hil.board_bench import ROBOT, BoardBench
from tests.hil.boards import MegaBoard

pytestmark = pytest.mark.slow

SPEED = 0.2


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[BoardBench]:
    with closing(BoardBench(MegaBoard(), tmp_path / "mega")) as running:
        yield running


@pytest.fixture
def cable(bench: BoardBench, tmp_path: Path) -> Iterator[Cable]:
    with Cable(bench.path, tmp_path / "port") as connected:
        yield connected


@pytest.fixture
def driven(cable: Cable) -> Iterator[Driven]:
    with Driven(str(cable.path)) as driver:
        yield driver


def newest(driven: Driven, topic: str) -> object:
    received = driven.received.get(topic, [])
    return received[-1] if received else None


def volts(driven: Driven) -> float:
    battery = newest(driven, "battery_state")
    return battery.voltage if isinstance(battery, BatteryState) else 0.0


def yaw_rate(driven: Driven) -> float:
    imu = newest(driven, "imu/data")
    return imu.angular_velocity.z if isinstance(imu, Imu) else 0.0


def echo_range(driven: Driven) -> float:
    echo = newest(driven, "ultrasonic")
    return echo.range if isinstance(echo, Range) else 0.0


def test_handshake_drive_and_sensor_data(bench: BoardBench, driven: Driven, cable: Cable) -> None:
    """Ticks, yaw rate, battery voltage and range have the values that the bench simulates."""
    bench.apply(lambda board: board.set("echo", 5831))
    bench.apply(lambda board: board.set("battery", 12500))
    drive(driven, cable, SPEED)
    answer = cable.newest(VersionLine)
    assert isinstance(answer, VersionLine)
    assert (answer.name, answer.port) == ("chefbot", "mega2560")
    driven.turn = 0.05
    push(driven, cable, SPEED, lambda: driven.ticks > 4000)
    expected = 2 * driven.turn / ROBOT.wheels.separation
    push(driven, cable, SPEED, lambda: yaw_rate(driven) == pytest.approx(expected, rel=0.1))
    driven.turn = 0.0
    driven.rest()
    driven.until(lambda: bench.wheels.speed == [0.0, 0.0], "standstill")
    before = len(driven.received["wheel_ticks"])
    driven.until(lambda: len(driven.received["wheel_ticks"]) > before + 5, "ticks")
    assert _ticks(newest(driven, "wheel_ticks")) == tuple(bench.wheels.ticks)
    driven.until(
        lambda: volts(driven) == pytest.approx(12.5, abs=0.05), "the battery, which the board filters"
    )
    driven.until(lambda: echo_range(driven) == pytest.approx(1.0, abs=0.01), "the echo")
    driven.until(lambda: "The board is OK." in driven.health, "health")


def _ticks(message: object) -> tuple[int, int]:
    assert isinstance(message, WheelTicks)
    return message.left, message.right


def test_the_emergency_stop_button_latches(bench: BoardBench, driven: Driven, cable: Cable) -> None:
    drive(driven, cable, SPEED)
    bench.apply(lambda board: board.set("estop", 1))
    driven.until(lambda: "emergency stop button" in driven.health, "the diagnostic")
    bench.apply(lambda board: board.set("estop", 0))
    count = len(cable.lines)
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    status = cable.newest(StatusLine)
    assert (
        isinstance(status, StatusLine)
        and status.state == BoardState.STOPPED
        and status.flags & BoardFlag.ESTOP_INPUT
    )
    clear_faults(driven, cable)
    drive(driven, cable, SPEED)


def test_a_wheel_that_turns_backwards_stops_both(bench: BoardBench, driven: Driven, cable: Cable) -> None:
    drive(driven, cable, SPEED)
    count = len(cable.lines)
    bench.reversed = 1
    driven.until(lambda: "right encoder" in driven.health, "the diagnostic")
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    bench.reversed = None
    clear_faults(driven, cable)
    drive(driven, cable, SPEED)


def test_a_board_reset_while_driving_stands_until_a_zero_command(
    bench: BoardBench, driven: Driven, cable: Cable
) -> None:
    drive(driven, cable, SPEED)
    push(driven, cable, SPEED, lambda: driven.ticks > 2000)
    bench.apply(lambda board: board.reset())
    driven.until(lambda: driven.ticks < 2000, "the restart: they are counted since")
    count = len(cable.lines)
    driven.until(lambda: ready(cable), "the new session")
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    assert driven.ticks < 2000  # it has not driven since the restart
    drive(driven, cable, SPEED)


def test_the_cable_can_be_pulled_and_plugged_back(bench: BoardBench, driven: Driven, cable: Cable) -> None:
    drive(driven, cable, SPEED)
    assert bench.stops_after(cable.pull, lambda: drive(driven, cable, SPEED)) <= 200.0
    driven.until(lambda: "broke" in driven.health or "no motor board" in driven.health, "the diagnostic")
    cable.plug()
    count = len(cable.lines)
    driven.until(lambda: ready(cable), "the connection")
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    drive(driven, cable, SPEED)


@pytest.mark.rotated("a lost board or sensor")
def test_an_imu_lost_on_the_bus_is_reported_and_recovers(
    bench: BoardBench, driven: Driven, cable: Cable
) -> None:
    drive(driven, cable, SPEED)
    bench.apply(lambda board: board.set("imu_answers", 0))
    driven.until(lambda: "No IMU answers" in driven.health, "the diagnostic")
    ticks = driven.ticks
    push(
        driven, cable, SPEED, lambda: driven.ticks > ticks + 1000
    )  # odometry continues with the wheels alone
    count = len(driven.received["imu/data"])  # lines come in order: what the board sent before is here by now
    push(driven, cable, SPEED, lambda: driven.ticks > ticks + 2000)
    assert len(driven.received["imu/data"]) == count
    bench.apply(lambda board: board.set("imu_answers", 1))
    driven.until(lambda: len(driven.received["imu/data"]) > count + 10, "the IMU")
