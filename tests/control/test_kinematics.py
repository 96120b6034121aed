"""From a twist to the ticks/s of the board: the radius of a wheel enters once."""

from __future__ import annotations

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.devices.session import MS, opened, speeds

from chefbot.board.session import BoardSession
from chefbot.control.kinematics import twist_of, wheel_speeds
from chefbot.robot.drivetrain import Calibration
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot

DRAWN = load_robot("chefbot")
CALIBRATED = msgspec.structs.replace(
    DRAWN, calibration=Calibration(left_wheel=1.02, right_wheel=0.99, separation=1.03)
)


def board_ticks(robot: Robot, v: float, w: float) -> tuple[int, int]:
    """The ticks/s on the wire to the board for a twist in m/s and rad/s."""
    session: BoardSession = opened()
    ((left, right),) = speeds(session.command(*wheel_speeds(v, w, robot), 1010 * MS))
    return left, right


@given(st.floats(-0.5, 0.5), st.floats(-2.0, 2.0))
def test_an_uncalibrated_robot_rolls_as_drawn(v: float, w: float) -> None:
    half = w * DRAWN.wheels.separation / 2
    ticks_per_metre = DRAWN.motor.ticks_per_turn / (math.pi * DRAWN.wheels.diameter)
    expected = ((v - half) * ticks_per_metre, (v + half) * ticks_per_metre)
    assert board_ticks(DRAWN, v, w) == pytest.approx(expected, abs=0.5 + 1e-6)


@given(st.floats(-0.5, 0.5), st.floats(-2.0, 2.0))
def test_a_calibrated_robot_rolls_as_measured(v: float, w: float) -> None:
    left, right = board_ticks(CALIBRATED, v, w)
    per_tick = DRAWN.metres_per_tick
    rolled = left * 1.02 * per_tick, right * 0.99 * per_tick
    half = w * 1.03 * DRAWN.wheels.separation / 2
    assert rolled == pytest.approx((v - half, v + half), abs=per_tick)


@pytest.mark.parametrize("robot", [DRAWN, CALIBRATED])
@given(st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))
def test_twist_and_wheel_speeds_are_inverse(robot: Robot, v: float, w: float) -> None:
    assert twist_of(*wheel_speeds(v, w, robot), robot) == pytest.approx((v, w), abs=1e-12)
