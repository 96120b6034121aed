"""Tests the firmware through its C interface and the emulated board on a pseudo-terminal."""

from __future__ import annotations

import math
import os
import random
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.firmware.host_board import STOPPED, HostBoard
from tests.firmware.serial_lines import Message, add_checksum, parse_message
from tests.support.waiting import PATIENCE

DRIVING, READY = 2, 1


class BoardWithMotors:
    """A board with two first-order motors and their encoders."""

    def __init__(self, board: HostBoard) -> None:
        self.board = board
        self.speed = [0.0, 0.0]
        self._position = [0.0, 0.0]
        self._ticks = [0, 0]

    def step(self) -> list[Message]:
        """Advance by 10 ms and return the messages of the board."""
        no_load = self.board.constants["no_load"]
        for wheel in (0, 1):
            duty = self.board.state.duty[wheel] / 1000.0 * 0.95
            self.speed[wheel] += (duty * no_load - self.speed[wheel]) * (1.0 - math.exp(-0.01 / 0.13))
            self._position[wheel] += self.speed[wheel] * 0.01
            ticks = math.floor(self._position[wheel]) - self._ticks[wheel]
            self._ticks[wheel] += ticks
            self.board.lib.chefbot_board_turn(self.board.handle, wheel, ticks)
        return self.board.advance(10)

    @property
    def ticks(self) -> tuple[int, int]:
        return self._ticks[0], self._ticks[1]


@pytest.fixture
def motors() -> BoardWithMotors:
    board = HostBoard()
    board.advance(300)
    board.open_session()
    board.send_command("s", 0, 0)
    board.advance(10)
    return BoardWithMotors(board)


def test_the_handshake_contains_the_robot_constants() -> None:
    board = HostBoard()
    answer = board.open_session().fields
    constants = board.constants
    assert answer[:4] == ("7", "chefbot", "1", "host")
    assert int(answer[4], 16) == constants["hash"]
    names = ("max_wheel", "max_forward", "max_turn", "acceleration")
    assert [int(a) for a in answer[8:12]] == [constants[n] for n in names]
    assert int(answer[5]) == constants["ticks_per_turn_milli"]


def test_two_boards_in_one_process_are_independent() -> None:
    first, second = HostBoard(), HostBoard()
    first.open_session()
    first.lib.chefbot_board_turn(first.handle, 0, 500)
    first.lib.chefbot_board_estop(first.handle, 1)
    first.advance(100)
    second.advance(100)
    assert first.state.state == STOPPED and first.state.ticks[0] == 500
    assert second.state.state == 0 and second.state.ticks[0] == 0


@pytest.mark.parametrize("lost, flipped", [(0.2, 0.0), (0.0, 0.01), (0.2, 0.01)])
def test_a_corrupt_line_causes_no_motion_and_keeps_the_ticks(
    motors: BoardWithMotors, lost: float, flipped: float
) -> None:
    """Commands at 50 Hz on a line with 1 % of flipped bits and 20 % of lost lines; odometry from the `e` lines."""
    rng = random.Random(4)
    received: list[Message] = []
    steps_after_stop = 0
    for step in range(1500):
        target = 3000 if 100 < step < 1100 else 0
        if step % 2 == 0:
            motors.board.sequence = (motors.board.sequence + 1) % 65536
            line = add_checksum(f"s {motors.board.sequence} {target} {target}")
            if rng.random() >= lost:
                motors.board.write(_flip(line, flipped, rng))
        received += [m for m in motors.step() if m.letter == "e" and rng.random() >= lost]
        duty = list(motors.board.state.duty)
        steps_after_stop = steps_after_stop + 1 if target == 0 else 0
        assert steps_after_stop < 200 or abs(motors.speed[0]) < 60, (
            "the wheel turns two seconds after the last command"
        )
        assert steps_after_stop < 300 or duty == [0, 0]
    assert motors.ticks[0] > 2_000  # with 80 % of the lines corrupt the motion is intermittent
    assert abs(int(received[-1].fields[1]) - motors.ticks[0]) < 0.01 * motors.ticks[0]
    assert abs(int(received[-1].fields[2]) - motors.ticks[1]) < 0.01 * motors.ticks[1]


def _flip(line: bytes, share: float, rng: random.Random) -> bytes:
    """Return the line with a random share of its bits flipped."""
    return bytes(b ^ sum(1 << i for i in range(8) if rng.random() < share) for b in line)


def test_a_dead_computer_at_full_speed_stops_the_wheels(motors: BoardWithMotors) -> None:
    top = motors.board.constants["max_forward"]
    for step in range(300):
        if step % 5 == 0:
            motors.board.send_command("s", top, top)
        motors.step()
    assert motors.speed[0] > 0.9 * top
    motors.board.send_command("s", top, top)
    for _ in range(20):
        motors.step()
    assert list(motors.board.state.duty) == [0, 0]
    assert motors.board.state.state == READY


# ---- the emulated board as a process


@pytest.fixture
def program(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A process with an emulated board, and the opened pseudo-terminal."""
    link = tmp_path / "board"
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "from chefbot.cli.app import main; main()",
            "board",
            "emulate",
            "--link",
            str(link),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout and process.stdin
    assert process.stdout.readline().startswith("A motor board with motor model")
    assert process.stdout.readline().strip() == str(link)
    line = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    yield process, line
    os.close(line)
    process.terminate()
    assert process.wait(PATIENCE) == 0
    assert not link.exists()
    process.stdin.close()
    process.stdout.close()


class Pty:
    """The computer's end of the pseudo-terminal, which sends and receives complete lines."""

    def __init__(self, line: int) -> None:
        self._line = line
        self._rest = b""
        self._unread: deque[Message] = deque()

    def send(self, text: str) -> None:
        os.write(self._line, add_checksum(text))

    def _read(self) -> None:
        try:
            self._rest += os.read(self._line, 65536)
        except BlockingIOError:
            time.sleep(0.002)
        *lines, self._rest = self._rest.split(b"\n")
        self._unread += [parse_message(line) for line in lines]

    def wait_for(self, letter: str) -> Message:
        """Return the next such line; none is skipped, however late this process reads."""
        for _ in range(100_000):
            while self._unread:
                message = self._unread.popleft()
                if message.letter == letter:
                    return message
            self._read()
        raise AssertionError(f"no {letter!r} line was received")


@pytest.mark.slow
def test_silence_on_the_pty_stops_the_wheels(program: tuple[subprocess.Popen[str], int]) -> None:
    pty = Pty(program[1])
    pty.wait_for("e")
    pty.send("v 5 1")
    sequence = int(pty.wait_for("v").fields[-2])
    for count in range(60):
        sequence = (sequence + 1) % 65536
        pty.send(f"s {sequence} {0 if count == 0 else 2000} {0 if count == 0 else 2000}")
        pty.wait_for("e")
    driven = pty.wait_for("e")
    assert int(driven.fields[1]) > 200 and int(driven.fields[2]) > 200
    start = int(driven.fields[0])
    status = pty.wait_for("s")
    while int(status.fields[0]) < start + 400_000:  # by the board's clock
        status = pty.wait_for("s")
    assert status.fields[1] == str(READY)
    assert status.fields[6:8] == ("0", "0")


@pytest.mark.slow
def test_the_stdin_button_latches_an_emergency_stop(program: tuple[subprocess.Popen[str], int]) -> None:
    process, line = program
    assert process.stdin
    pty = Pty(line)
    pty.wait_for("e")
    process.stdin.write("estop 1\n")
    process.stdin.flush()
    for _ in range(500):
        if int(pty.wait_for("e").fields[-1], 16) & 1:
            break
    assert int(pty.wait_for("e").fields[-1], 16) & 1
