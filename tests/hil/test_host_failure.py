"""Tests that the board stops the wheels in time when the host program dies or hangs or its cable is pulled."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from chefbot.robot.motion_limits import max_speed
from tests.devices.driven import Driven, drive, push
from tests.devices.emulated import Cable
from tests.hil.board_bench import NO_LOAD, ROBOT, BoardBench
from tests.hil.boards import HostPort, LockstepBoard, MegaBoard
from tests.support.waiting import PATIENCE, wait_for

pytestmark = pytest.mark.slow

LIMIT_MS = 200.0
HOST = """
import sys
from tests.devices.driven import Driven
driven = Driven(sys.argv[1])
began = driven.loop.now_ns
def command():
    new = driven.loop.now_ns - began < 2_000_000_000
    driven.speed = 0.0 if new or "release the controls" in driven.health else float(sys.argv[2])
    driven.loop.schedule(driven.loop.now_ns + 50_000_000, 0, command)
command()
driven.loop.run()
"""


@pytest.fixture(params=[HostPort, MegaBoard])
def bench(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[BoardBench]:
    board: LockstepBoard = request.param()
    with closing(BoardBench(board, tmp_path / "board")) as running:
        yield running


def at_full_speed(bench: BoardBench) -> bool:
    return min(bench.wheels.speed) > 0.95 * max_speed(ROBOT) / ROBOT.metres_per_tick


def suspend(process: subprocess.Popen[bytes]) -> None:
    """Send SIGSTOP and wait until the process is suspended."""
    process.send_signal(signal.SIGSTOP)
    stat = Path(f"/proc/{process.pid}/stat")
    wait_for(lambda: stat.read_text().rpartition(")")[2].split()[0] == "T", "suspension")


def kill(process: subprocess.Popen[bytes]) -> None:
    """Send SIGKILL and wait until the process has ended."""
    process.send_signal(signal.SIGKILL)
    process.wait(PATIENCE)


@pytest.mark.rotated
@pytest.mark.parametrize("fault", [kill, suspend])
def test_a_dead_or_hanging_host_program_stops_the_wheels(
    bench: BoardBench,
    fault: Callable[[subprocess.Popen[bytes]], None],
    record_property: Callable[[str, object], None],
) -> None:
    root = Path(__file__).parents[2]
    command = [sys.executable, "-c", HOST, str(bench.path), str(max_speed(ROBOT) / ROBOT.wheel_radius)]
    process = subprocess.Popen(command, env={**os.environ, "PYTHONPATH": str(root)}, cwd=root)
    try:
        wait_for(lambda: at_full_speed(bench), "full speed")
        stopped = bench.stops_after(lambda: fault(process))
    finally:
        process.kill()
        process.wait(PATIENCE)
    record_property("stopped_ms", stopped)
    assert 100.0 < stopped <= LIMIT_MS
    wait_for(lambda: bench.wheels.speed == [0.0, 0.0], "standstill")


def test_a_pulled_cable_stops_the_wheels(
    bench: BoardBench, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    with Cable(bench.path, tmp_path / "port") as cable, Driven(str(cable.path)) as driven:
        drive(driven, cable, max_speed(ROBOT))

        def to_full_speed() -> None:
            push(driven, cable, max_speed(ROBOT), lambda: at_full_speed(bench))

        to_full_speed()
        stopped = bench.stops_after(cable.pull, to_full_speed)
    record_property("stopped_ms", stopped)
    assert 0.0 < stopped <= LIMIT_MS


def test_the_wheels_can_reach_full_speed() -> None:
    """The other tests of this module wait for full speed."""
    assert max_speed(ROBOT) / ROBOT.metres_per_tick < 0.95 * NO_LOAD
