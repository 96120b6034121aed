"""The driver against the firmware's own program over a pty: drives, loses its cable, meets a restart, is halted."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from tests.devices.emulated import PATIENCE, Cable, Emulator, wait_for

from chefbot.devices.board import BoardDevice, BoardParams
from chefbot.devices.line.lines import Motion, Status
from chefbot.devices.line.words import Flag
from chefbot.errors import UserError
from chefbot.msgs.base import Message
from chefbot.msgs.chefbot_msgs import WheelSpeeds, WheelTicks
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.std_msgs import Bool, Header
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import WallClock
from chefbot.runtime.loop import DEVICE, Loop
from chefbot.runtime.node import Context
from chefbot.runtime.transforms import Transforms

PERIOD_NS = 50_000_000


class Driven:
    """A board device on a real clock, commanded as the base node does it: 20 times a second, zeros too."""

    def __init__(self, port: str, robot: str = "chefbot") -> None:
        self.loop = Loop(WallClock(), time.time_ns())
        self.heard: dict[str, list[Message]] = {}
        self.speed: float | None = 0.0
        """m/s of both wheels; None: upstream is dead."""
        self.stamp_age_ns = 0
        self.loop.tap(lambda one: self.heard.setdefault(one.topic, []).append(one.message))
        context = Context("board", self.loop, load_robot(robot), Transforms())
        self.device = BoardDevice(context, BoardParams(port=port))
        self.device.start()
        self._command()

    def _command(self) -> None:
        now = self.loop.now_ns
        if self.speed is not None:
            header = Header.of(now - self.stamp_age_ns, "base_link")
            self.loop.publish("wheel_speeds", WheelSpeeds(header, self.speed, self.speed), "base")
        self.loop.at(now + PERIOD_NS, DEVICE, self._command)

    def until(self, condition: Callable[[], bool], what: str) -> None:
        limit = time.monotonic() + PATIENCE
        self.loop.run(until=lambda: condition() or time.monotonic() > limit)
        assert condition(), f"waited {PATIENCE} s for {what}: {self.health}"

    def rest(self) -> None:
        """Command a stop a few times."""
        self.speed = 0.0
        count = len(self.heard["wheel_speeds"]) + 3
        self.until(lambda: len(self.heard["wheel_speeds"]) >= count, "commands")

    def press(self, stop: bool) -> None:
        self.loop.publish("emergency_stop", Bool(stop), "page")

    @property
    def health(self) -> str:
        told = self.heard.get("diagnostics", [])
        return told[-1].status[0].message if told and isinstance(told[-1], DiagnosticArray) else ""

    @property
    def ticks(self) -> int:
        told = self.heard.get("wheel_ticks", [])
        return told[-1].left if told and isinstance(told[-1], WheelTicks) else 0


@pytest.fixture
def emulated(tmp_path: Path) -> Iterator[Emulator]:
    one = Emulator(tmp_path)
    yield one
    one.close()


@pytest.fixture
def cable(emulated: Emulator, tmp_path: Path) -> Iterator[Cable]:
    one = Cable(emulated.path, tmp_path / "port")
    one.plug()
    yield one
    one.close()


@pytest.fixture
def driven(cable: Cable) -> Iterator[Driven]:
    one = Driven(str(cable.path))
    yield one
    one.device.stop()


def set_speed(cable: Cable) -> int:
    status = cable.newest(Status)
    return status.set_left if isinstance(status, Status) else 0


def standing(cable: Cable, since: int, lines: int = 5) -> bool:
    """So many status lines in a row, none before `since`, with no speed in force and no duty."""
    last = cable.since(since, Status)[-lines:]
    return len(last) == lines and all(
        isinstance(line, Status) and line.set_left == line.set_right == line.duty_left == line.duty_right == 0
        for line in last
    )


def drive(driven: Driven, cable: Cable, speed: float = 0.2) -> int:
    """Until the wheels hold the speed; gives the ticks/s."""
    wanted = round(speed / load_robot("chefbot").metres_per_tick)
    driven.speed = 0.0
    driven.until(lambda: ready(cable), "the board to be ready")
    driven.rest()
    driven.speed = speed
    driven.until(lambda: set_speed(cable) == wanted, "the speed")
    return wanted


def ready(cable: Cable) -> bool:
    motion = cable.newest(Motion)
    return isinstance(motion, Motion) and not motion.flags & (
        Flag.NO_SESSION | Flag.NEUTRAL_FIRST | Flag.NO_SPEED
    )


def test_it_drives_and_tells_what_it_senses(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    before = driven.ticks
    driven.until(lambda: driven.ticks > before + 500, "ticks")
    driven.until(lambda: len(driven.heard.get("battery_state", [])) > 1, "the battery")
    driven.until(lambda: len(driven.heard.get("ultrasonic", [])) > 1, "the ultrasonic ranger")
    driven.until(lambda: "The board is well." in driven.health, "health")
    assert len(driven.heard["imu/data"]) > 10
    stamps = [m.header.stamp.ns for m in driven.heard["wheel_ticks"] if isinstance(m, WheelTicks)]
    steps = [b - a for a, b in pairwise(stamps)]
    assert min(steps) > 0
    assert math.isclose(sum(steps) / len(steps), 20e6, rel_tol=0.05)  # 50 Hz on the board's own clock


def test_no_more_commands_is_a_stop(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    driven.speed, count = None, len(cable.lines)
    driven.until(lambda: standing(cable, count), "standstill")
    motion = cable.newest(Motion)
    assert isinstance(motion, Motion) and motion.flags & Flag.NO_SPEED
    assert not motion.flags & Flag.NO_SESSION  # it still says that it lives
    drive(driven, cable)


def test_old_commands_are_not_obeyed(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    driven.stamp_age_ns, count = 1_000_000_000, len(cable.lines)
    driven.until(lambda: standing(cable, count), "standstill")


def test_not_a_number_is_not_obeyed(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    driven.speed, count = math.nan, len(cable.lines)
    driven.until(lambda: standing(cable, count), "standstill")
    assert b"nan" not in cable.said


def test_a_pulled_cable_stops_it_and_plugged_in_elsewhere_it_goes_on(driven: Driven, cable: Cable) -> None:
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
    driven.until(lambda: "let go of the controls once" in driven.health, "the reason")
    drive(driven, cable)


def test_a_board_that_restarts_in_mid_drive_stands(driven: Driven, cable: Cable, emulated: Emulator) -> None:
    drive(driven, cable)
    driven.until(lambda: driven.ticks > 3000, "ticks")
    count = len(cable.lines)
    emulated.tell("power")
    driven.until(lambda: any(line.sequence == 0 for line in cable.lines[count:]), "the restart")
    count = len(cable.lines)
    driven.until(lambda: ready(cable), "the new session")
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    assert driven.ticks < 3000  # counted since the board began
    drive(driven, cable)


def test_stop_latches_until_it_is_released_and_a_stop_was_commanded(driven: Driven, cable: Cable) -> None:
    drive(driven, cable)
    count = len(cable.lines)
    driven.press(True)
    driven.until(lambda: standing(cable, count), "standstill")
    driven.until(lambda: "emergency stop command" in driven.health, "the news")
    driven.press(False)
    driven.until(
        lambda: isinstance(m := cable.newest(Motion), Motion) and not m.flags & Flag.ESTOP_COMMAND, "release"
    )
    count = len(cable.lines)
    driven.until(lambda: standing(cable, count, 10), "standstill although a speed is commanded")
    drive(driven, cable)


def test_a_blocked_wheel_is_named_and_cleared(driven: Driven, cable: Cable, emulated: Emulator) -> None:
    drive(driven, cable)
    emulated.tell("block 1 1")
    driven.until(lambda: "right wheel" in driven.health or "right encoder" in driven.health, "the news")
    emulated.tell("block 1 0")
    driven.press(True)
    driven.press(False)
    drive(driven, cable)


def test_another_version_or_robot_is_refused_in_a_sentence(cable: Cable) -> None:
    driven = Driven(str(cable.path), robot="desk")
    try:
        with pytest.raises(UserError, match=r"ticks per turn of a wheel.*chefbot flash"):
            driven.until(lambda: False, "the refusal")
    finally:
        driven.device.stop()


def test_a_port_that_nobody_answers_at_is_told(tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    try:
        with pytest.raises(UserError, match="nothing there answers as a board"):
            _run_alone(os.ttyname(theirs))
        with pytest.raises(UserError, match=r"/none does not exist.*port:=auto"):
            Driven(str(tmp_path / "none"))
    finally:
        os.close(ours)
        os.close(theirs)


def _run_alone(port: str) -> None:
    driven = Driven(port)
    try:
        driven.until(lambda: False, "the refusal")
    finally:
        driven.device.stop()


HOST = """
import sys, time
from tests.devices.test_board import Driven
driven = Driven(sys.argv[1])
began = driven.loop.now_ns
def command():
    driven.speed = 0.0 if driven.loop.now_ns - began < 2_000_000_000 else 0.2
    driven.loop.at(driven.loop.now_ns + 50_000_000, 0, command)
command()
driven.loop.run()
"""


@pytest.mark.parametrize("how", [signal.SIGSTOP, signal.SIGKILL])
def test_a_host_program_that_is_halted_or_killed_leaves_motors_off(cable: Cable, how: signal.Signals) -> None:
    root = Path(__file__).parents[2]
    environment: dict[str, Any] = {**os.environ, "PYTHONPATH": str(root)}
    process = subprocess.Popen([sys.executable, "-c", HOST, str(cable.path)], env=environment, cwd=root)
    try:
        wait_for(lambda: set_speed(cable) > 2000, "the speed")
        count = len(cable.lines)
        process.send_signal(how)
        wait_for(lambda: standing(cable, count, 10), "standstill")
    finally:
        process.kill()
        process.wait(PATIENCE)
