"""The keyboard through a real pseudo-terminal: what drives, what stops, and how the terminal comes back."""

from __future__ import annotations

import os
import subprocess
import sys
import termios
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.fake_robot import fake_robot
from tests.support.waiting import PATIENCE

from chefbot.config import ConfigError
from chefbot.devices.keyboard import ARROWS, KeyboardDevice, keys_of
from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_speed
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node_container import NodeContainer

SECOND = 1_000_000_000
KEYBOARD = "chefbot.devices.keyboard:KeyboardDevice"


class Pty:
    """`type` is what a hand does; the program under test has the other end as its standard input."""

    def __init__(self) -> None:
        self.hand, self.end = os.openpty()
        self.stdin = os.fdopen(self.end, closefd=False)

    def type(self, text: str) -> None:
        os.write(self.hand, text.encode())

    def modes(self) -> list[object]:
        return termios.tcgetattr(self.end)

    @property
    def echoes(self) -> bool:
        return bool(termios.tcgetattr(self.end)[3] & (termios.ECHO | termios.ICANON))

    def hang_up(self) -> None:
        if self.hand >= 0:
            os.close(self.hand)
            self.hand = -1


@pytest.fixture
def pty(monkeypatch: pytest.MonkeyPatch) -> Iterator[Pty]:
    one = Pty()
    monkeypatch.setattr(sys, "stdin", one.stdin)
    yield one
    one.hang_up()
    one.stdin.close()
    os.close(one.end)


class Driven:
    """A system with a keyboard; `commands` holds (v, w) of every command and when."""

    def __init__(self, *more: str) -> None:
        self.loop = Loop(StepClock())
        self.system = NodeContainer(self.loop, load_robot("chefbot"), 1)
        self.commands: list[tuple[int, float, float]] = []
        self.loop.add_observer(self._record)
        self.entries = {kind: NodeEntry(kind=kind) for kind in (KEYBOARD, *more)}

    def start(self) -> None:
        self.system.launch(Launch(name="t", description="", args={}, nodes=self.entries))

    def next_command(self) -> tuple[float, float]:
        """Simulated time runs on until the thread of the terminal has brought the next key."""
        count = len(self.commands)
        self.loop.run(until=lambda: len(self.commands) > count)
        return self.commands[-1][1:]

    def run(self, seconds: float) -> None:
        self.loop.run(until_ns=self.loop.now_ns + round(seconds * SECOND))

    def _record(self, publication: Publication) -> None:
        if isinstance(publication.message, Twist):
            twist = publication.message
            self.commands.append((publication.time_ns, twist.linear.x, twist.angular.z))


@pytest.fixture
def driven(pty: Pty) -> Iterator[Driven]:
    one = Driven()
    one.start()
    yield one
    one.system.stop()


def test_a_key_drives_until_the_dead_man_timeout(pty: Pty, driven: Driven) -> None:
    pty.type("i")
    assert driven.next_command()[0] > 0
    driven.run(5.0)
    times, speeds, turns = zip(*driven.commands, strict=True)
    top = speeds.index(max(speeds))
    assert 0.05 < speeds[top] <= max_speed(driven.system.robot)
    assert list(speeds[: top + 1]) == sorted(speeds[: top + 1])
    assert list(speeds[top:]) == sorted(speeds[top:], reverse=True)
    assert speeds[-1] == 0.0
    assert set(turns) == {0.0}
    assert {b - a for a, b in pairwise(times)} == {SECOND // 10}
    assert times[-1] - times[0] < 2 * SECOND, "it must fall silent, so that navigation gets the robot back"


def test_space_stops_at_once_and_is_sent_even_at_standstill(pty: Pty, driven: Driven) -> None:
    pty.type(" ")
    assert driven.next_command() == (0.0, 0.0)
    pty.type("u")
    v, w = driven.next_command()
    assert v > 0 and w > 0
    while driven.commands[-1][1:] != (0.0, 0.0):
        pty.type("k")
        driven.next_command()
    assert len(driven.commands) < 30


def test_all_keys_between_two_ticks_count(pty: Pty, driven: Driven) -> None:
    keyboard = driven.system.nodes[KEYBOARD]
    assert isinstance(keyboard, KeyboardDevice)
    before = keyboard._teleop.speed
    pty.type("ww" + "x" * 5 + "\x1b[D")
    assert driven.next_command()[1] >= 0
    for _ in range(50):
        if keyboard._teleop.speed != before:
            break
        driven.run(0.1)
    driven.run(0.4)
    assert keyboard._teleop.speed == pytest.approx(before * 1.1**2 * 0.9**5)
    assert driven.commands[-1][2] > 0.0


@given(st.text(max_size=12))
def test_any_text_is_parsed_as_keys(text: str) -> None:
    keys = keys_of(text)
    assert all(len(key) <= 2 for key in keys), "a capital may be two letters when small"
    assert bool(keys) == bool(text)


def test_arrows_and_capitals_act_as_their_letters() -> None:
    assert keys_of("".join(ARROWS)) == ["i", ",", "l", "j"]
    assert keys_of("I\x1b[A") == ["i", "i"]
    assert keys_of("i\x1b[5~") == ["i", "\x1b"]


def test_terminal_is_restored_at_the_end(pty: Pty) -> None:
    before = pty.modes()
    driven = Driven()
    driven.start()
    assert not pty.echoes
    driven.system.stop()
    assert pty.modes() == before


def test_terminal_is_restored_if_another_node_fails_to_start(pty: Pty) -> None:
    before = pty.modes()
    driven = Driven()
    kind = "chefbot.devices.maps.map_file:MapFileDevice"
    driven.entries[kind] = NodeEntry(kind=kind, params={"map": "/no/such/map.yaml"})
    with pytest.raises(ConfigError, match="does not exist"):
        driven.start()
    assert not pty.echoes
    driven.system.stop()
    assert pty.modes() == before


def test_terminal_is_restored_after_a_program_error(pty: Pty) -> None:
    before = pty.modes()
    script = (
        "import termios\nfrom chefbot.devices.terminal import Terminal\nTerminal(print, print)\n"
        "assert not termios.tcgetattr(0)[3] & termios.ECHO\nraise RuntimeError('on purpose')"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], stdin=pty.end, capture_output=True, timeout=PATIENCE
    )
    assert b"on purpose" in done.stderr
    assert pty.modes() == before


def test_a_closed_terminal_ends_the_run(pty: Pty, driven: Driven) -> None:
    pty.hang_up()
    with pytest.raises(UserError, match="terminal of the keyboard is gone"):
        driven.loop.run()


def test_a_missing_terminal_is_an_error_with_a_remedy(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "keys.txt"
    file.write_text("iii")
    with file.open() as stdin:
        for one in (stdin, None):
            monkeypatch.setattr(sys, "stdin", one)
            with pytest.raises(UserError, match="needs a terminal"):
                Driven().start()


@pytest.mark.slow
@pytest.mark.parametrize("end", ["\x03", "robot gone"])
def test_keyboard_teleop_drives_and_restores_the_terminal(pty: Pty, end: str) -> None:
    """The whole command as a person starts it, in a session whose terminal this is."""
    before = pty.modes()
    script = (
        "import fcntl, os, sys, termios\nos.setsid()\nfcntl.ioctl(0, termios.TIOCSCTTY, 0)\n"
        "from chefbot.cli.app import main\nmain()"
    )
    with fake_robot() as robot:
        command = [sys.executable, "-c", script, "launch", "keyboard_teleop", f"page:={robot.url}"]
        process = subprocess.Popen(command, stdin=pty.end, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert process.stdout is not None
        output = b""
        while b"limits are" not in output:
            line = process.stdout.readline()
            assert line, process.communicate(timeout=PATIENCE)
            output += line
        pty.type("i")
        drive = robot.commands.get(timeout=PATIENCE)
        assert 0.0 < drive.v < 1.0 and drive.w == 0.0  # type: ignore[attr-defined]
        if end == "\x03":
            pty.type(end)
        else:
            robot.server.stop()
        _, fault = process.communicate(timeout=PATIENCE)
    assert process.returncode == (0 if end == "\x03" else 2)
    assert (b"has ended" in fault) == (end != "\x03")
    assert pty.modes() == before
