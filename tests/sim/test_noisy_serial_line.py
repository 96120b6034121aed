"""Tests driving and odometry with a serial line to the simulated board that corrupts and loses lines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.sim.board_drive import DeadReckoningDriver, drive, robot_in

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.std_msgs import Header
from chefbot.sim.board import SimulatedBoard
from chefbot.sim.faults.serial_link import flip_bits
from chefbot.sim.motor_board import SimulatedMotorBoard


class NoisyMotorBoard:
    """A motor board behind a serial line that flips bits and loses lines in both directions."""

    def __init__(self, motors: SimulatedMotorBoard, bit_errors: float, lost: float) -> None:
        self._motors, self.bit_errors, self.lost = motors, bit_errors, lost
        self._rng = np.random.default_rng(11)
        self._rest = b""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._motors, name)

    def write(self, data: bytes) -> None:
        self._motors.write(self._corrupt(data.splitlines(keepends=True)))

    def read(self) -> bytes:
        *lines, self._rest = (self._rest + self._motors.read()).split(b"\n")
        return self._corrupt([line + b"\n" for line in lines])

    def _corrupt(self, lines: list[bytes]) -> bytes:
        kept = b"".join(line for line in lines if self._rng.random() >= self.lost)
        return flip_bits(kept, self.bit_errors, self._rng)


def drive_curves(bit_errors: float, lost: float) -> tuple[float, float, SimulatedBoard]:
    """Drive curves with stops for a minute, and return the distance, the odometry's error and the board.

    The error is the distance in metres between dead reckoning on the received ticks and on all ticks; in the last
    second the line has no errors.
    """
    sim, board = robot_in("empty", "perfect", 1, "chefbot")
    motors = NoisyMotorBoard(board.motors, bit_errors, lost)
    board.motors = motors  # type: ignore[assignment]
    received, reference = DeadReckoningDriver(sim, board), DeadReckoningDriver(sim, board)
    path, before = 0.0, sim.truth().pose
    for step in range(3150):
        stands = step % 400 < 75 or step >= 3000
        if step == 3100:
            motors.bit_errors = motors.lost = 0.0
        received.step(0.0 if stands else 0.2, 0.0 if stands else 0.4 * math.sin(step / 60))
        reference.integrate(WheelTicks(Header(), *sim.wheel_ticks()))
        path, before = path + before.distance(sim.truth().pose), sim.truth().pose
        assert abs(sim.truth().v) < 0.25, "faster than commanded"
    assert abs(sim.truth().v) < 0.002
    return path, received.pose.distance(reference.pose), board


@pytest.mark.rotated
@pytest.mark.slow
@pytest.mark.parametrize(
    ("bit_errors", "lost", "min_distance"), [(0.0, 0.2, 9.0), (0.001, 0.2, 9.0), (0.01, 0.2, 0.3)]
)
def test_a_noisy_line_loses_less_than_one_percent_of_distance(
    bit_errors: float, lost: float, min_distance: float
) -> None:
    """Ticks are cumulative, so that a lost line is made up for by the next one.

    With 1 % bit errors only one line in fifty is valid, and the driver keeps the robot standing most of the time.
    """
    path, error, board = drive_curves(bit_errors, lost)
    assert min_distance < path < 10.0
    assert error < 0.01 * path
    assert bit_errors == 0.0 or board.motors.state.refused > 100


def test_a_noisy_line_to_a_standing_robot_moves_nothing() -> None:
    sim, board = robot_in("empty")
    board.motors = NoisyMotorBoard(board.motors, 0.01, 0.2)  # type: ignore[assignment]
    start = sim.truth().pose
    drive(board, 0.0, 0.0, 20.0)
    assert start.distance(sim.truth().pose) < 0.001
