"""A line between computer and simulated board that damages and loses: what is driven, and what is known of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.sim.driving import Walker, drive, robot_in

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.std_msgs import Header
from chefbot.sim.board import SimulatedBoard
from chefbot.sim.motor_board import SimulatedMotorBoard


class BadMotors:
    """The board behind a line that loses a fifth of all lines, both ways, and turns one bit in a hundred."""

    def __init__(self, motors: SimulatedMotorBoard, bit_errors: float, lost: float) -> None:
        self._motors, self.bit_errors, self.lost = motors, bit_errors, lost
        self._chance = np.random.default_rng(11)
        self._rest = b""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._motors, name)

    def write(self, data: bytes) -> None:
        self._motors.write(self._spoilt(data.splitlines(keepends=True)))

    def read(self) -> bytes:
        *lines, self._rest = (self._rest + self._motors.read()).split(b"\n")
        return self._spoilt([line + b"\n" for line in lines])

    def _spoilt(self, lines: list[bytes]) -> bytes:
        kept = b"".join(line for line in lines if self._chance.random() >= self.lost)
        bits = np.unpackbits(np.frombuffer(kept, np.uint8))
        return np.packbits(bits ^ (self._chance.random(bits.size) < self.bit_errors)).tobytes()


def weave(bit_errors: float, lost: float) -> tuple[float, float, SimulatedBoard]:
    """Curves and rests for a minute, then a good line for a second: metres driven, and how far dead reckoning on the
    ticks that were heard is from that on all ticks."""
    sim, board = robot_in("empty", "perfect", 1, "chefbot")
    motors = BadMotors(board.motors, bit_errors, lost)
    board.motors = motors  # type: ignore[assignment]
    heard, whole = Walker(sim, board), Walker(sim, board)
    path, before = 0.0, sim.truth().pose
    for beat in range(3150):
        rests = beat % 400 < 75 or beat >= 3000
        if beat == 3100:
            motors.bit_errors = motors.lost = 0.0
        heard.go(0.0 if rests else 0.2, 0.0 if rests else 0.4 * math.sin(beat / 60))
        whole.count(WheelTicks(Header(), *sim.wheel_ticks()))
        path, before = path + before.distance(sim.truth().pose), sim.truth().pose
        assert abs(sim.truth().v) < 0.25, "faster than anybody asked for"
    assert abs(sim.truth().v) < 0.002
    return path, heard.pose.distance(whole.pose), board


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bit_errors", "lost", "least_path"), [(0.0, 0.2, 9.0), (0.001, 0.2, 9.0), (0.01, 0.2, 0.3)]
)
def test_a_noisy_line_loses_less_than_one_percent_of_distance(
    bit_errors: float, lost: float, least_path: float
) -> None:
    """Ticks add up on the board: what a lost line told, the next one tells again. One bit in a hundred leaves one
    line in fifty; then the driver lets the robot stand."""
    path, error, board = weave(bit_errors, lost)
    assert least_path < path < 10.0
    assert error < 0.01 * path
    assert bit_errors == 0.0 or board.motors.state.refused > 100


def test_a_noisy_line_to_a_standing_robot_moves_nothing() -> None:
    sim, board = robot_in("empty")
    board.motors = BadMotors(board.motors, 0.01, 0.2)  # type: ignore[assignment]
    start = sim.truth().pose
    drive(board, 0.0, 0.0, 20.0)
    assert start.distance(sim.truth().pose) < 0.001
