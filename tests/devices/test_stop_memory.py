"""A robot whose programs end while it is stopped, however they end, starts stopped; any browser releases it."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.support.waiting import PATIENCE

from chefbot.devices.stop_memory import ESTOP_RESTORED, ESTOP_STATE_UNKNOWN, StopFile
from chefbot.msgs.std_msgs import Bool
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

ROBOT = load_robot("chefbot")
LAUNCH = """
description: What remembers a STOP, and the base.
clock: wall
args: {wire: "off"}
nodes:
  base: {kind: "chefbot.nodes.drive_base:DriveBaseNode"}
  memory: {kind: "chefbot.devices.stop_memory:EmergencyStopStore"}
  finger: {kind: "finger:Finger"}
"""
FINGER = '''
from chefbot.msgs.std_msgs import Bool
from chefbot.runtime.node import Device, NoParams, Out, every


class Finger(Device):
    """Presses STOP after a second."""

    params: NoParams
    stop_request: Out[Bool]

    @every(hz=1)
    def press(self) -> None:
        self.stop_request.publish(Bool(True))
'''


class Life:
    """Base and memory from their start on."""

    def __init__(self, robot: Robot = ROBOT) -> None:
        self.loop = Loop(StepClock())
        self.system = NodeContainer(self.loop, robot, 1)
        self.states: list[bool] = []
        self.notices: list[str] = []
        self.loop.subscribe("emergency_stop", "test", lambda one: self.states.append(one.data))  # type: ignore[attr-defined]
        self.loop.subscribe("memory/notice", "test", lambda one: self.notices.append(one.data))  # type: ignore[attr-defined]
        nodes = {
            "base": NodeEntry(kind="chefbot.nodes.drive_base:DriveBaseNode"),
            "memory": NodeEntry(
                kind="chefbot.devices.stop_memory:EmergencyStopStore",
                remap={"stop_memory/notice": "memory/notice"},
            ),
        }
        self.system.launch(Launch(name="t", description="", args={}, nodes=nodes))
        self.run()

    def run(self) -> None:
        self.loop.run(until_ns=self.loop.now_ns + 10_000_000)

    def request(self, press: bool) -> None:
        self.loop.publish("stop_request", Bool(press), "page")
        self.run()

    def lose_board(self) -> None:
        self.loop.publish("board_connected", Bool(False), "board")
        self.run()

    def end(self) -> None:
        self.system.stop()


def until(condition: Callable[[], bool]) -> None:
    give_up = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < give_up
        time.sleep(0.02)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.lists(st.booleans(), max_size=3), min_size=1, max_size=4))
def test_the_stop_state_is_restored_at_startup(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch, lives: list[list[bool]]
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path_factory.mktemp("state") / "not" / "there"))
    stopped = False
    for requests in lives:
        life = Life()
        assert life.states[-1] is stopped
        assert life.notices == [ESTOP_RESTORED] * stopped
        for stop in requests:
            life.request(stop)
            stopped = stop
            assert life.states[-1] is stopped
        life.end()


def test_an_unknown_stop_state_is_stopped_and_can_be_released(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("where a folder should be")
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "file"))
    life = Life()
    assert life.states[-1] is True and life.notices[0].startswith(ESTOP_STATE_UNKNOWN)
    life.request(False)
    assert life.states[-1] is False
    life.end()


def test_a_lost_board_does_not_stop_the_robot_after_a_restart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    life = Life()
    life.lose_board()
    assert life.states[-1] is True
    life.end()
    life = Life()
    assert life.states[-1] is False and not life.notices
    life.end()


def test_a_stop_pressed_while_the_board_is_lost_is_restored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    life = Life()
    life.lose_board()
    life.request(True)
    life.end()
    life = Life()
    assert life.states[-1] is True and life.notices == [ESTOP_RESTORED]
    life.end()


def test_each_robot_of_a_computer_keeps_its_own_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    life = Life()
    life.request(True)
    life.end()
    other = Life(msgspec.structs.replace(ROBOT, name="other"))
    assert other.states[-1] is False and not other.notices
    other.end()


def test_a_full_disk_keeps_a_stop_and_reports_unsaved_states(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    life = Life()

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "write", full)  # nothing is written, only renamed
    life.request(True)
    until(lambda: StopFile(tmp_path, ROBOT.name).read())
    monkeypatch.setattr(Path, "replace", full)
    life.request(False)
    until(lambda: (life.run(), bool(life.notices))[1])
    assert "cannot be kept: No space" in life.notices[-1]
    life.end()


@pytest.mark.slow
def test_a_robot_killed_while_stopped_restarts_stopped(tmp_path: Path) -> None:
    path = tmp_path / "finger.yaml"
    path.write_text(LAUNCH)
    (tmp_path / "finger.py").write_text(FINGER)
    state = tmp_path / "state"

    def run(*arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "chefbot", "launch", str(path), *arguments]
        environment = {**os.environ, "CHEFBOT_STATE": str(state)}
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)

    first = run()
    until(lambda: (state / f"{ROBOT.name}.stopped").exists())
    first.send_signal(signal.SIGKILL)
    first.communicate()
    path.write_text(LAUNCH.replace("  finger:", "  # finger:"))
    assert ESTOP_RESTORED in run("duration:=1").communicate(timeout=PATIENCE)[0]
