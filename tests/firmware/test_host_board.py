"""The C interface and the program on a pty, from outside."""

from __future__ import annotations

import math
import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.firmware.host_board import STOPPED, HostBoard
from tests.firmware.lines import Message, framed, unframed
from tests.support.waiting import PATIENCE

DRIVING, READY = 2, 1


class Car:
    """A motor model on a board: first-order wheels with friction."""

    def __init__(self, board: HostBoard) -> None:
        self.board = board
        self.speed = [0.0, 0.0]
        self._place = [0.0, 0.0]
        self._told = [0, 0]

    def step(self) -> list[Message]:
        """Ten milliseconds; what the board says in them."""
        no_load = self.board.constants["no_load"]
        for wheel in (0, 1):
            duty = self.board.state.duty[wheel] / 1000.0 * 0.95
            self.speed[wheel] += (duty * no_load - self.speed[wheel]) * (1.0 - math.exp(-0.01 / 0.13))
            self._place[wheel] += self.speed[wheel] * 0.01
            ticks = math.floor(self._place[wheel]) - self._told[wheel]
            self._told[wheel] += ticks
            self.board.lib.chefbot_board_turn(self.board.handle, wheel, ticks)
        return self.board.advance(10)

    @property
    def ticks(self) -> tuple[int, int]:
        return self._told[0], self._told[1]


@pytest.fixture
def car() -> Car:
    board = HostBoard()
    board.advance(300)
    board.shake_hands()
    board.say("s", 0, 0)
    board.advance(10)
    return Car(board)


def test_the_handshake_contains_the_robot_constants() -> None:
    board = HostBoard()
    answer = board.shake_hands().fields
    constants = board.constants
    assert answer[:4] == ("7", "chefbot", "1", "host")
    assert int(answer[4], 16) == constants["hash"]
    names = ("max_wheel", "max_forward", "max_turn", "acceleration")
    assert [int(a) for a in answer[8:12]] == [constants[n] for n in names]
    assert int(answer[5]) == constants["ticks_per_turn_milli"]


def test_two_boards_in_one_process_are_independent() -> None:
    one, two = HostBoard(), HostBoard()
    one.shake_hands()
    one.lib.chefbot_board_turn(one.handle, 0, 500)
    one.lib.chefbot_board_estop(one.handle, 1)
    one.advance(100)
    two.advance(100)
    assert one.state.state == STOPPED and one.state.ticks[0] == 500
    assert two.state.state == 0 and two.state.ticks[0] == 0


@pytest.mark.parametrize("lost, flipped", [(0.2, 0.0), (0.0, 0.01), (0.2, 0.01)])
def test_a_corrupt_line_causes_no_motion_and_keeps_the_ticks(car: Car, lost: float, flipped: float) -> None:
    """1 % of bits flipped, 20 % of lines lost: commands at 50 Hz, odometry read from the `e` lines that arrive."""
    chance = random.Random(4)
    told: list[Message] = []
    still = 0
    for step in range(1500):
        wanted = 3000 if 100 < step < 1100 else 0
        if step % 2 == 0:
            car.board.sequence = (car.board.sequence + 1) % 65536
            line = framed(f"s {car.board.sequence} {wanted} {wanted}")
            if chance.random() >= lost:
                car.board.write(_flip(line, flipped, chance))
        told += [m for m in car.step() if m.letter == "e" and chance.random() >= lost]
        duty = list(car.board.state.duty)
        still = still + 1 if wanted == 0 else 0
        assert still < 200 or abs(car.speed[0]) < 60, "moves two seconds after the last command to move"
        assert still < 300 or duty == [0, 0]
    assert car.ticks[0] > 2_000  # with four lines of five damaged it drives in starts
    assert abs(int(told[-1].fields[1]) - car.ticks[0]) < 0.01 * car.ticks[0]
    assert abs(int(told[-1].fields[2]) - car.ticks[1]) < 0.01 * car.ticks[1]


def _flip(line: bytes, share: float, chance: random.Random) -> bytes:
    """Some bits of a line wrong."""
    return bytes(b ^ sum(1 << i for i in range(8) if chance.random() < share) for b in line)


def test_a_dead_computer_at_full_speed_stops_the_wheels(car: Car) -> None:
    top = car.board.constants["max_forward"]
    for step in range(300):
        if step % 5 == 0:
            car.board.say("s", top, top)
        car.step()
    assert car.speed[0] > 0.9 * top
    car.board.say("s", top, top)
    for _ in range(20):
        car.step()
    assert list(car.board.state.duty) == [0, 0]
    assert car.board.state.state == READY


# ---- the program


@pytest.fixture
def program(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The board as a process, and the computer's end of its pty."""
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
    """Reads whole lines; waits for what it wants, however long the machine takes."""

    def __init__(self, line: int) -> None:
        self._line = line
        self._rest = b""
        self.heard: list[Message] = []

    def say(self, text: str) -> None:
        os.write(self._line, framed(text))

    def read(self) -> list[Message]:
        try:
            self._rest += os.read(self._line, 65536)
        except BlockingIOError:
            time.sleep(0.002)
        *lines, self._rest = self._rest.split(b"\n")
        news = [unframed(line) for line in lines]
        self.heard += news
        return news

    def wait_for(self, letter: str) -> Message:
        for _ in range(100_000):
            for message in self.read():
                if message.letter == letter:
                    return message
        raise AssertionError(f"no {letter!r} line came")


def test_silence_on_the_pty_stops_the_wheels(program: tuple[subprocess.Popen[str], int]) -> None:
    pty = Pty(program[1])
    pty.wait_for("e")
    pty.say("v 5 1")
    sequence = int(pty.wait_for("v").fields[-2])
    for count in range(60):
        sequence = (sequence + 1) % 65536
        pty.say(f"s {sequence} {0 if count == 0 else 2000} {0 if count == 0 else 2000}")
        pty.wait_for("e")
    driven = pty.wait_for("e")
    assert int(driven.fields[1]) > 200 and int(driven.fields[2]) > 200
    start = int(driven.fields[0])
    status = pty.wait_for("s")
    while int(status.fields[0]) < start + 400_000:  # by the board's own clock
        status = pty.wait_for("s")
    assert status.fields[1] == str(READY)
    assert status.fields[6:8] == ("0", "0")


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
