"""Tests the emulated hardware of a robot at pseudo-terminals: its ports, its bytes and its true state."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from chefbot.errors import UserError
from chefbot.lidar.models import LIDARS
from chefbot.robot.load import load_robot
from chefbot.sim.firmware import CONTROL_NS
from chefbot.sim.ports import hardware as module
from chefbot.sim.ports.hardware import (
    MAX_LAG_NS,
    TRUTH_PERIOD_NS,
    EmulatedHardware,
    HardwareOptions,
    TrueState,
    run_hardware,
)

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")

ROBOT = load_robot("chefbot_lidar")


def options(folder: Path, robot: str = "chefbot_lidar") -> HardwareOptions:
    return HardwareOptions(
        load_robot(robot), "room", "perfect", 1, folder / "board", folder / "lidar", start="[0.5, 0.2, 0.3]"
    )


@pytest.fixture
def hardware(tmp_path: Path) -> Iterator[EmulatedHardware]:
    made = EmulatedHardware(options(tmp_path))
    yield made
    made.close()


class Program:
    """A program that has a port open, and what it has read."""

    def __init__(self, path: Path) -> None:
        self._port = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def read(self) -> bytes:
        try:
            return os.read(self._port, 65536)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        os.write(self._port, data)

    def close(self) -> None:
        os.close(self._port)


def run(hardware: EmulatedHardware, seconds: float, *programs: Program) -> list[bytes]:
    """Run the hardware; return what each program has read."""
    received = [b""] * len(programs)
    for _ in range(round(seconds * 1e9 / CONTROL_NS)):
        hardware.step()
        received = [data + program.read() for data, program in zip(received, programs, strict=True)]
    return received


def test_a_step_is_a_control_period_of_the_board(hardware: EmulatedHardware) -> None:
    assert hardware.now_ns == 0
    run(hardware, 0.2)
    assert hardware.now_ns == 200_000_000


def test_the_true_state_begins_at_the_start(hardware: EmulatedHardware) -> None:
    run(hardware, 0.1)
    state = hardware.truth()
    assert state.time == 0.1 and state.pose == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    assert (state.collisions, state.touched) == (0, "")
    assert TrueState(**{**json.loads(state.line()), "pose": state.pose}) == state


def test_the_lidar_at_its_port_is_one_that_its_driver_knows(
    hardware: EmulatedHardware, tmp_path: Path
) -> None:
    assert ROBOT.sensors.lidar is not None
    program, session = Program(tmp_path / "lidar"), LIDARS[ROBOT.sensors.lidar.driver].open()
    (received,) = run(hardware, 0.3, program)
    program.close()
    samples = sum(len(part.ranges) for part in session.receive_data(received, hardware.now_ns))
    assert samples > 0.2 * 4500


def test_opening_the_port_of_the_board_resets_it(hardware: EmulatedHardware, tmp_path: Path) -> None:
    run(hardware, 0.1)
    assert hardware._board.resets == 0
    program = Program(tmp_path / "board")
    (during_boot,) = run(hardware, 0.5, program)
    (after,) = run(hardware, 1.0, program)
    assert hardware._board.resets == 1
    assert during_boot == b"" and after != b"", "the boot loader comes first"
    program.close()
    run(hardware, 0.1)
    again = Program(tmp_path / "board")
    run(hardware, 0.1, again)
    assert hardware._board.resets == 2
    again.close()


def test_a_cable_that_is_out_has_no_port_until_it_is_in_again(
    hardware: EmulatedHardware, tmp_path: Path
) -> None:
    link = tmp_path / "lidar"
    assert link.is_symlink()
    hardware.unplug("lidar")
    hardware.unplug("lidar")
    assert not link.is_symlink() and (tmp_path / "board").is_symlink()
    run(hardware, 0.1)
    hardware.plug("lidar")
    hardware.plug("lidar")
    program = Program(link)
    (received,) = run(hardware, 0.2, program)
    assert received
    program.close()
    hardware.close()
    assert not link.is_symlink() and not (tmp_path / "board").is_symlink()


def test_a_robot_without_a_lidar_has_no_such_hardware(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="has no lidar with a driver"):
        EmulatedHardware(options(tmp_path, "chefbot"))
    assert list(tmp_path.iterdir()) == []


class Watch:
    """A wall clock that passes while somebody sleeps, and by `lag_ns` for each of the first looks at it."""

    def __init__(self, lag_ns: int = 0, looks: int = 10_000) -> None:
        self.now_ns, self.lag_ns, self.looks, self.slept = 1_000_000_000_000, lag_ns, looks, 0.0

    def wall_ns(self) -> int:
        self.looks -= 1
        self.now_ns += self.lag_ns if self.looks >= 0 else 0
        return self.now_ns

    def sleep(self, seconds: float) -> None:
        self.slept += seconds
        self.now_ns += round(seconds * 1e9)


def operated(
    folder: Path, monkeypatch: pytest.MonkeyPatch, lines: list[str], watch: Watch
) -> tuple[list[TrueState], list[set[str]]]:
    """Run the hardware with lines of standard input, one for each true state; return states and ports."""
    states, ports = list[TrueState](), list[set[str]]()
    given = iter([*lines, ""])

    def publish(line: str) -> None:
        states.append(TrueState(**json.loads(line)))
        ports.append({path.name for path in folder.iterdir() if path.is_symlink()})

    monkeypatch.setattr(module, "wall_ns", watch.wall_ns)
    monkeypatch.setattr(module, "time", watch)
    monkeypatch.setattr(module, "select", SimpleNamespace(select=lambda *_: ([1], [], [])))
    monkeypatch.setattr(module, "sys", SimpleNamespace(stdin=SimpleNamespace(readline=lambda: next(given))))
    run_hardware(options(folder), threading.Event(), publish)
    return states, ports


def test_lines_plug_cables_and_the_end_of_them_ends_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = ["unplug lidar\n", "plug lidar\n", "dance\n", "plug kettle\n", "unplug board\n"]
    states, ports = operated(tmp_path, monkeypatch, lines, Watch())
    assert [state.time for state in states] == pytest.approx([0.1 * k for k in range(1, 7)])
    both = {"board", "lidar"}
    assert ports == [both, {"board"}, both, both, both, {"lidar"}]
    assert list(tmp_path.iterdir()) == [], "all is unplugged at the end"


def test_the_hardware_keeps_pace_with_the_wall_clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    watch = Watch()
    states, _ = operated(tmp_path, monkeypatch, ["\n"] * 3, watch)
    assert watch.slept == pytest.approx(states[-1].time, abs=2e-9 * TRUTH_PERIOD_NS)


def test_a_slow_computer_slows_the_hardware_down(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    watch = Watch(lag_ns=3 * CONTROL_NS)
    states, _ = operated(tmp_path, monkeypatch, ["\n"] * 3, watch)
    assert watch.slept == 0.0 and states[-1].time == pytest.approx(0.4)


def test_what_was_lost_is_hardly_caught_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    slow = 20
    watch = Watch(3 * CONTROL_NS, slow)
    states, _ = operated(tmp_path, monkeypatch, ["\n"] * 9, watch)
    in_time = states[-1].time - slow * CONTROL_NS / 1e9
    assert in_time - MAX_LAG_NS / 1e9 - 0.02 <= watch.slept <= in_time
