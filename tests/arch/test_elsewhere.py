"""chefbot as on Windows and on a Mac: without Unix's modules and calls (tests/arch/elsewhere.py)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from chefbot.devices.gamepad_reader import GamepadReader
from chefbot.devices.terminal import Terminal
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.runtime.recorded_log import read_log

PATIENCE = 500.0


def elsewhere(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    program = Path(__file__).parent / "elsewhere.py"
    return subprocess.run(
        [sys.executable, str(program), *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )


@pytest.mark.slow
def test_everything_can_be_imported(tmp_path: Path) -> None:
    done = elsewhere("import", folder=tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    assert int(done.stdout) > 400


@pytest.mark.slow
def test_a_robot_explores_a_room_and_is_recorded(tmp_path: Path) -> None:
    log = tmp_path / "room.mcap"
    words = ["explore", "world:=room", "headless:=true", "speed:=0", "duration:=8", "wire:=off"]
    done = elsewhere("launch", *words, f"record:={log}", folder=tmp_path)
    assert done.returncode == 0 and "Fault" not in done.stderr, done.stderr[-2000:]
    wheels = [one.data for one in read_log(log).messages if one.topic == "wheel_ticks"]
    ticks = [WheelTicks.from_cdr(data) for data in (wheels[0], wheels[-1])]
    assert max(abs(ticks[1].left - ticks[0].left), abs(ticks[1].right - ticks[0].right)) > 1000


@pytest.mark.slow
def test_emulating_a_board_names_the_supported_systems(tmp_path: Path) -> None:
    done = elsewhere("board", "emulate", "--link", "board", folder=tmp_path)
    assert done.returncode == 2 and "can be emulated on Linux and macOS only" in done.stderr


def test_keyboard_and_gamepad_name_the_supported_systems(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chefbot.devices.terminal.termios", None)
    with pytest.raises(
        UserError, match="terminals of Linux and macOS only; drive with the keys in the robot's web UI"
    ):
        Terminal(lambda _: None, lambda: None)
    monkeypatch.setattr("chefbot.devices.input_events.fcntl", None)
    with pytest.raises(UserError, match="gamepads are read on Linux only; drive with a gamepad"):
        GamepadReader("auto", lambda *_: None, lambda _: None, lambda _: None, lambda _: None)
