"""The driver against the firmware's own program over a pty: drives, loses its cable, meets a restart, is halted."""

from __future__ import annotations

import math
import os
import re
import select
import statistics
import threading
import tty
from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import msgspec
import pytest
from tests.devices.driven import Driven, clear_faults, drive, push, ready, standing
from tests.devices.emulated import Cable, Emulator

from chefbot.board.framing import frame
from chefbot.board.messages import MotionLine
from chefbot.board.status_codes import BoardFlag
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.robot.load import load_robot


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Emulator]:
    with closing(Emulator(tmp_path_factory.mktemp("board"))) as one:
        yield one


@pytest.fixture
def emulated(program: Emulator) -> Emulator:
    """Just switched on."""
    program.inject("power")
    return program


@pytest.fixture
def cable(emulated: Emulator, tmp_path: Path) -> Iterator[Cable]:
    with Cable(emulated.path, tmp_path / "port") as one:
        yield one


@pytest.fixture
def driven(cable: Cable) -> Iterator[Driven]:
    with Driven(str(cable.path)) as one:
        yield one


@pytest.mark.slow
def test_board_drives_and_publishes_its_sensors(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    before = driven.ticks
    push(driven, cable, 0.2, lambda: driven.ticks > before + 500)
    driven.until(lambda: len(driven.received.get("battery_state", [])) > 1, "the battery")
    driven.until(lambda: len(driven.received.get("ultrasonic", [])) > 1, "the ultrasonic ranger")
    driven.until(lambda: "The board is OK." in driven.health, "health")
    assert len(driven.received["imu/data"]) > 10

    def steps() -> list[int]:
        stamps = [m.header.stamp.ns for m in driven.received["wheel_ticks"] if isinstance(m, WheelTicks)]
        return [b - a for a, b in pairwise(stamps)]

    # a computer that was busy for a moment receives many lines at once, whose stamps are close together
    driven.until(
        lambda: math.isclose(statistics.median(steps()[-25:]), 20e6, rel_tol=0.05), "50 Hz of its clock"
    )
    assert min(steps()) > 0


@pytest.mark.slow
def test_the_board_s_imu_is_not_published_beside_another_one(cable: Cable) -> None:
    robot = load_robot("chefbot")
    imu = msgspec.structs.replace(robot.sensors.imu, driver="bno085_rvc")
    sensors = msgspec.structs.replace(robot.sensors, imu=imu)
    with Driven(str(cable.path), msgspec.structs.replace(robot, sensors=sensors)) as driven:
        driven.until(lambda: len(driven.received.get("wheel_ticks", [])) > 50, "ticks")
    assert "imu/data" not in driven.received


@pytest.mark.slow
def test_missing_commands_stop_the_wheels(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    driven.speed, count = None, len(cable.lines)
    driven.until(lambda: standing(cable, count), "standstill")
    motion = cable.newest(MotionLine)
    assert isinstance(motion, MotionLine) and motion.flags & BoardFlag.NO_SPEED
    assert not motion.flags & BoardFlag.NO_SESSION  # the driver still sends heartbeats
    drive(driven, cable)


@pytest.mark.slow
def test_stale_commands_are_ignored(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    driven.stamp_age_ns, count = 1_000_000_000, len(cable.lines)
    driven.until(lambda: standing(cable, count), "standstill")


@pytest.mark.slow
def test_commands_that_are_not_a_number_are_ignored(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    driven.speed, count = math.nan, len(cable.lines)
    driven.until(lambda: standing(cable, count), "standstill")
    assert b"nan" not in cable.sent


@pytest.mark.slow
def test_an_unplugged_board_stops_and_reconnects_at_another_port(driven: Driven, cable: Cable) -> None:
    """The board stops itself; what was commanded all the while does not move it again before a stop was."""
    drive(driven, cable)
    count = len(cable.lines)
    cable.pull()
    driven.until(lambda: standing(cable, count), "standstill")
    driven.until(lambda: "broke" in driven.health or "no motor board" in driven.health, "the news")
    cable.plug()
    count = len(cable.lines)
    driven.until(lambda: ready(cable), "the connection")
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    driven.until(lambda: "release the controls once" in driven.health, "the reason")
    drive(driven, cable)


@pytest.mark.slow
def test_a_board_that_restarts_while_driving_stands(driven: Driven, cable: Cable, emulated: Emulator) -> None:
    drive(driven, cable)
    push(driven, cable, 0.2, lambda: driven.ticks > 3000)
    emulated.inject("power")
    driven.until(lambda: driven.ticks < 3000, "the restart: they are counted since")
    count = len(cable.lines)
    driven.until(lambda: ready(cable), "the new session")
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    assert driven.ticks < 3000  # it has not driven since the restart
    drive(driven, cable)


@pytest.mark.slow
def test_emergency_stop_latches_until_release_and_a_zero_command(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    count = len(cable.lines)
    driven.press(True)
    driven.until(lambda: standing(cable, count), "standstill")
    driven.until(lambda: "emergency stop command" in driven.health, "the news")
    assert "release STOP to enable them" in driven.health and "refused a line" not in driven.health
    driven.press(False)
    driven.until(
        lambda: (
            isinstance(m := cable.newest(MotionLine), MotionLine) and not m.flags & BoardFlag.ESTOP_COMMAND
        ),
        "release",
    )
    count = len(cable.lines)
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    drive(driven, cable)


@pytest.mark.slow
def test_a_blocked_wheel_is_reported_and_can_be_cleared(
    driven: Driven, cable: Cable, emulated: Emulator
) -> None:
    drive(driven, cable)
    emulated.inject("block 1 1")
    driven.until(lambda: "The motors are off; press STOP" in driven.fault in driven.health, "the news")
    emulated.inject("block 1 0")
    assert "right wheel" in driven.fault or "right encoder" in driven.fault
    clear_faults(driven, cable)
    driven.until(lambda: driven.fault == "", "the end of the fault")
    drive(driven, cable)


def test_another_protocol_version_is_refused() -> None:
    ours, theirs = os.openpty()
    tty.setraw(theirs)

    def answer() -> None:
        received = b""
        while b"end" not in received:
            if not select.select([ours], [], [], 0.02)[0]:
                os.write(ours, frame("z 0 a line of another version"))
                continue
            received += os.read(ours, 4096)
            for token in re.findall(rb"v (\d+) 1\*", received):
                os.write(ours, frame(f"v 0 {token.decode()} chefbot 2 future 1 2 3"))
            received = received[received.rfind(b"\n") + 1 :]

    board = threading.Thread(target=answer)
    board.start()
    try:
        with pytest.raises(UserError, match=r"uses protocol version 2.*chefbot board flash"):
            _run_alone(os.ttyname(theirs))
    finally:
        os.write(theirs, b"end")
        board.join()
        os.close(ours)
        os.close(theirs)


def test_a_board_of_another_robot_is_refused(cable: Cable) -> None:
    with (
        Driven(str(cable.path), robot="desk") as driven,
        pytest.raises(UserError, match=r"ticks per turn of a wheel.*chefbot board flash"),
    ):
        driven.until(lambda: False, "the refusal")


@pytest.mark.slow
def test_a_port_without_a_board_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chefbot.board.autodetect.DETECTION_TIMEOUT_NS", 200_000_000)
    ours, theirs = os.openpty()
    try:
        with pytest.raises(UserError, match="no motor board answers there"):
            _run_alone(os.ttyname(theirs))
        with pytest.raises(UserError, match=r"/none does not exist.*port:=auto"):
            Driven(str(tmp_path / "none"))
    finally:
        os.close(ours)
        os.close(theirs)


def _run_alone(port: str) -> None:
    with Driven(port) as driven:
        driven.until(lambda: False, "the refusal")
