"""What the first motions of a newly wired board show."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.board.bring_up import (
    HandTurn,
    WheelRun,
    direction_remedy,
    step_response,
    was_interrupted,
    wheel_findings,
    wheel_speeds,
)
from chefbot.board.messages import MotionLine
from chefbot.board.status_codes import BoardFlag

EXPECTED = 1000.0


@pytest.mark.parametrize("side", [0, 1])
@given(st.floats(0.6, 1.4), st.floats(-0.09, 0.09))
def test_a_wheel_that_turns_alone_is_right(side: int, own: float, foreign: float) -> None:
    counts = (round(EXPECTED * own), round(EXPECTED * foreign))
    ticks = counts if side == 0 else counts[::-1]
    assert wheel_findings(WheelRun(side, ticks, EXPECTED, 0)) == []


@pytest.mark.parametrize(
    ("side", "ticks", "flags", "text"),
    [
        (0, (3, 900), 0, "swap the connectors"),
        (1, (900, 3), 0, "swap the connectors"),
        (0, (-40, 0), BoardFlag.ENCODER_LEFT, "left encoder counts against its motor"),
        (1, (0, -40), BoardFlag.ENCODER_RIGHT, "right encoder counts against its motor"),
        (1, (0, 0), BoardFlag.ENCODER_RIGHT, "right encoder counted nothing"),
        (0, (10, 0), BoardFlag.STALL_LEFT, "left wheel is blocked"),
        (0, (10, 0), BoardFlag.ESTOP_INPUT, "emergency stop"),
        (0, (200, 0), 0, "counted 200 ticks, but 1000 were commanded"),
        (0, (1000, 300), 0, "right wheel turned as well"),
    ],
)
def test_each_mistake_of_the_wiring_has_its_remedy(
    side: int, ticks: tuple[int, int], flags: int, text: str
) -> None:
    (finding,) = wheel_findings(WheelRun(side, ticks, EXPECTED, flags))
    assert text in finding and finding.endswith(".")


@pytest.mark.parametrize(
    ("answer", "text"), [("f", ""), ("b", "two wires of the right"), ("n", "the wheel stands")]
)
def test_what_was_seen_decides_on_the_motor_s_wires(answer: str, text: str) -> None:
    assert text in direction_remedy(1, answer) and bool(direction_remedy(1, answer)) == bool(text)


def test_turns_by_hand_are_compared_with_the_robot_file() -> None:
    assert HandTurn(5020, 5, 1000.0).agrees
    assert HandTurn(2400, 5, 1000.0).ratio == pytest.approx(0.48) and not HandTurn(2400, 5, 1000.0).agrees


@given(st.floats(0.05, 0.3), st.floats(0.9, 1.1))
def test_the_rise_time_of_a_first_order_lag(lag: float, gain: float) -> None:
    times = np.arange(0.02, 2.0, 0.02)
    response = step_response(times, 1000.0 * gain * (1.0 - np.exp(-times / lag)), 1000.0)
    assert response.error == pytest.approx(gain - 1.0, abs=0.02)
    assert response.overshoot <= max(0.0, gain - 1.0) + 1e-9
    if gain > 0.97:
        assert response.rise_time == pytest.approx(-lag * math.log(1.0 - 0.9 / gain), abs=0.05)


def test_a_wheel_that_never_reaches_its_speed_is_not_good() -> None:
    times = np.arange(0.02, 2.0, 0.02)
    assert step_response(times, np.full(len(times), 500.0), 1000.0).rise_time == math.inf
    assert not step_response(times, np.full(len(times), 500.0), 1000.0).is_good
    assert step_response(times, np.full(len(times), 1000.0), 1000.0).is_good


def test_speeds_are_differences_of_ticks() -> None:
    assert wheel_speeds(np.array([0.0, 0.1, 0.3]), np.array([0.0, 10.0, 50.0])) == pytest.approx(
        [100.0, 200.0]
    )


@pytest.mark.parametrize(
    ("flags", "interrupted"),
    [
        ([0] * 50, False),
        ([0x0100] * 10 + [0] * 40, False),
        ([0] * 30 + [0x0100] + [0] * 19, True),
        ([0] * 30 + [0x0120] * 20, False),  # a latched fault has switched the motors off
        ([0] * 5, True),
    ],
)
def test_a_pause_of_the_speeds_after_the_begin_is_noticed(flags: list[int], interrupted: bool) -> None:
    start = 2**32 - 100_000  # the board's clock wraps
    lines = [MotionLine(i, (start + 20_000 * i) % 2**32, 0, 0, 0, 0, flag) for i, flag in enumerate(flags)]
    assert was_interrupted(lines) == interrupted
