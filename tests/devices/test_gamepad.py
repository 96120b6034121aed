"""The gamepad by the bytes that Linux gives for one, through a pipe: what drives, what stops, what never does."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.fake_robot import fake_robot
from tests.support.waiting import PATIENCE

from chefbot.control.gamepad_teleop import GamepadEvent, GamepadParams, GamepadTeleop
from chefbot.devices.input_events import ABS, EVENT, KEY, SYN, SYN_DROPPED, SYN_REPORT
from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Bool, String
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.ui.commands import Drive, Stop

ROBOT = load_robot("chefbot")
LIMITS = Limits.of(ROBOT)
TURN, FORWARD, STOP, DEAD_MAN = 0x00, 0x01, 0x131, 0x136
"""ABS_X, ABS_Y, BTN_EAST and BTN_TL."""
DT = 0.05


class Pad:
    """A pipe in the place of /dev/input/event0, and a hand."""

    def __init__(self, path: Path) -> None:
        self.path = path
        os.mkfifo(path)
        self.plug_in()

    def plug_in(self) -> None:
        self._handle = os.open(self.path, os.O_RDWR)
        self._write((KEY, STOP, 0), (KEY, DEAD_MAN, 0), (ABS, FORWARD, 0))

    def unplug(self) -> None:
        os.close(self._handle)

    def press(self, button: int) -> None:
        self._write((KEY, button, 1))

    def release(self, button: int) -> None:
        self._write((KEY, button, 0))

    def push(self, axis: int, value: float) -> None:
        self._write((ABS, axis, min(32767, round(32768 * value))))

    def lose_a_report(self) -> None:
        self._write((SYN, SYN_DROPPED, 0), (KEY, DEAD_MAN, 1))

    def _write(self, *events: tuple[int, int, int]) -> None:
        for kind, code, value in (*events, (SYN, SYN_REPORT, 0)):
            os.write(self._handle, EVENT.pack(0, 0, kind, code, value))


class Driven:
    """A loop with a gamepad; time runs on while it is waited for the pad's thread."""

    def __init__(self, path: Path, **params: Any) -> None:
        self.loop = Loop(StepClock())
        self.system = NodeContainer(self.loop, ROBOT, 1)
        self.published: list[Publication] = []
        self.loop.add_observer(self.published.append)
        entry = NodeEntry(
            kind="chefbot.devices.gamepad:GamepadDevice", params={"device": str(path), **params}
        )
        self.system.launch(Launch(name="t", description="", args={}, nodes={"gamepad": entry}))

    def all(self, kind: type) -> list[Any]:
        return [one.message for one in self.published if isinstance(one.message, kind)]

    def until(self, condition: Any) -> None:
        give_up = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < give_up, self.published[-3:]
            time.sleep(0.002)
            self.run(DT)

    def run(self, seconds: float) -> None:
        self.loop.run(until_ns=self.loop.now_ns + round(seconds * 1e9))

    def speed(self) -> float:
        return float(self.all(Twist)[-1].linear.x)


@pytest.fixture
def pad(tmp_path: Path) -> Pad:
    return Pad(tmp_path / "event0")


@pytest.fixture
def driven(pad: Pad) -> Iterator[Driven]:
    one = Driven(pad.path)
    yield one
    one.system.stop()


def test_a_stick_drives_only_while_the_dead_man_button_is_held(pad: Pad, driven: Driven) -> None:
    pad.push(FORWARD, -1.0)
    driven.until(lambda: driven.all(String))
    driven.run(1.0)
    assert not driven.all(Twist)
    pad.press(DEAD_MAN)
    driven.until(lambda: driven.all(Twist) and driven.speed() > 0.0)
    assert driven.speed() == pytest.approx(0.5 * LIMITS.speed)
    pad.push(TURN, -1.0)
    driven.until(lambda: driven.all(Twist)[-1].angular.z > 0.0)
    pad.release(DEAD_MAN)
    driven.until(lambda: driven.speed() == 0.0)
    count = len(driven.all(Twist))
    driven.run(2.0)
    assert len(driven.all(Twist)) == count, "navigation may have the robot back"


@pytest.mark.slow
def test_unplugging_stops_and_reconnecting_does_not_resume(pad: Pad, driven: Driven) -> None:
    pad.push(FORWARD, -1.0)
    pad.press(DEAD_MAN)
    driven.until(lambda: driven.all(Twist) and driven.speed() > 0.0)
    pad.unplug()
    driven.until(lambda: driven.speed() == 0.0)
    assert "gone; the robot stops" in driven.all(String)[-1].data
    pad.plug_in()
    pad.push(FORWARD, -1.0)
    driven.until(lambda: " at " in driven.all(String)[-1].data and "gone" not in driven.all(String)[-1].data)
    driven.run(1.0)
    assert driven.speed() == 0.0
    pad.press(DEAD_MAN)
    driven.until(lambda: driven.speed() > 0.0)


def test_stop_is_sent_until_confirmed_without_other_buttons(pad: Pad, driven: Driven) -> None:
    pad.press(STOP)
    driven.until(lambda: len(driven.all(Bool)) > 3)
    pad.release(STOP)
    driven.until(lambda: len(driven.all(Bool)) > 10)
    assert all(press.data for press in driven.all(Bool))
    driven.loop.publish("emergency_stop", Bool(True), "base")
    driven.run(0.2)
    count = len(driven.all(Bool))
    driven.run(1.0)
    assert len(driven.all(Bool)) == count


def test_a_silent_gamepad_releases_the_dead_man_switch(pad: Pad) -> None:
    driven = Driven(pad.path, drive={"timeout": 1.0})
    pad.push(FORWARD, -1.0)
    pad.press(DEAD_MAN)
    driven.until(lambda: driven.all(Twist) and driven.speed() > 0.0)
    driven.run(2.0)
    assert driven.speed() == 0.0
    pad.push(FORWARD, -0.9)
    driven.run(0.5)
    assert driven.speed() == 0.0, "the button must be let go first"
    driven.system.stop()


def test_a_missing_gamepad_is_reported_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="event7 does not exist; plug it in"):
        Driven(tmp_path / "event7")


def test_a_lost_report_lets_go_of_the_dead_man_button(pad: Pad, driven: Driven) -> None:
    pad.push(FORWARD, -1.0)
    pad.press(DEAD_MAN)
    driven.until(lambda: driven.all(Twist) and driven.speed() > 0.0)
    pad.lose_a_report()
    driven.until(lambda: driven.speed() == 0.0)


def test_a_device_that_is_not_a_gamepad_drives_by_numbers(pad: Pad) -> None:
    driven = Driven(pad.path, drive={"dead_man_button": "292", "forward_axis": "5"})
    pad.push(5, -1.0)
    pad.release(292)
    pad.press(292)
    driven.until(lambda: driven.all(Twist) and driven.speed() > 0.0)
    driven.system.stop()


EVENTS = st.builds(
    GamepadEvent,
    st.sampled_from(["axis", "button"]),
    st.sampled_from(["left_x", "left_y", "dpad_y", "east", "left_shoulder"]),
    st.sampled_from([-1.0, -0.3, 0.0, 0.05, 1.0]),
    st.booleans(),
)


@given(st.lists(st.one_of(EVENTS, st.just("gone")), max_size=30))
def test_only_a_button_pressed_after_release_allows_motion(events: list[Any]) -> None:
    drive, up, held = GamepadTeleop(LIMITS, GamepadParams()), False, False
    for event in events:
        if event == "gone":
            drive.reset()
            up = held = False
            continue
        stops = drive.process_event(event)
        assert stops == (event.kind == "button" and event.name == "east" and event.value != 0.0)
        if event.kind == "button" and event.name == "left_shoulder":
            pressed = event.value != 0.0
            held, up = pressed and up and not event.initial, not pressed
        twist = drive.twist(DT)
        assert (twist is not None) == held
        if twist is not None:
            v, w = twist
            assert (
                LIMITS.scale(v, w) == pytest.approx(1.0)
                and abs(v) <= drive.speed_fraction * LIMITS.speed + 1e-9
            )
        assert 0.1 <= drive.speed_fraction <= 1.0


@pytest.mark.slow
def test_gamepad_teleop_drives_and_stops_a_running_robot(pad: Pad) -> None:
    """The whole command, as a person starts it."""
    with fake_robot() as robot:
        command = [sys.executable, "-m", "chefbot", "launch", "gamepad_teleop", f"page:={robot.url}"]
        process = subprocess.Popen([*command, f"device:={pad.path}"], stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        while "Gamepad" not in process.stdout.readline():
            assert process.poll() is None
        pad.push(FORWARD, -1.0)
        pad.press(DEAD_MAN)
        drive = robot.commands.get(timeout=PATIENCE)
        while isinstance(drive, Drive) and drive.is_zero:
            drive = robot.commands.get(timeout=PATIENCE)
        assert isinstance(drive, Drive) and drive.v == pytest.approx(0.5) and drive.w == 0.0
        pad.press(STOP)
        while not isinstance(robot.commands.get(timeout=PATIENCE), Stop):
            pass
        process.terminate()
        process.communicate(timeout=PATIENCE)
