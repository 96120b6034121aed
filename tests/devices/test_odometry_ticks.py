"""Ticks that are made from a base's odometry: what wheels on the same path would count."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.kinematics import wheel_speeds
from chefbot.devices.odometry_ticks import OdometryTicks
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_speed, max_turn

ROBOT = load_robot("chefbot")
STEP_NS = 20_000_000
SPEED = st.floats(-1.0, 1.0)


def ticks_of_robot() -> OdometryTicks:
    return OdometryTicks(ROBOT, max_speed(ROBOT), max_turn(ROBOT))


def moved(pose: SE2, v: float, w: float, seconds: float) -> SE2:
    """Return the pose after an arc."""
    turn = w * seconds
    radius = v / w if abs(w) > 1e-9 else 0.0
    arc = (
        SE2(radius * math.sin(turn), radius * (1 - math.cos(turn)), turn)
        if radius
        else SE2(v * seconds, 0.0, turn)
    )
    return pose @ arc


@given(st.lists(st.tuples(SPEED, SPEED), min_size=1, max_size=30), st.floats(-3.0, 3.0))
def test_the_ticks_are_those_of_the_wheels(commands: list[tuple[float, float]], yaw: float) -> None:
    ticks, pose, stamp = ticks_of_robot(), SE2(5.0, -2.0, yaw), 10**9
    assert ticks.update(pose, stamp) == (0, 0)
    turned = [0.0, 0.0]
    for forward, turning in commands:
        v, w = forward * max_speed(ROBOT), turning * max_turn(ROBOT)
        pose, stamp = moved(pose, v, w, STEP_NS / 1e9), stamp + STEP_NS
        for wheel, speed in enumerate(wheel_speeds(v, w, ROBOT)):
            turned[wheel] += speed * STEP_NS / 1e9
        counted = ticks.update(pose, stamp)
    per_radian = ROBOT.motor.ticks_per_turn / (2 * math.pi)
    assert counted == pytest.approx([turn * per_radian for turn in turned], abs=1.0)
    assert ticks.restarts == 0


def test_a_base_that_begins_again_moves_no_wheel() -> None:
    ticks = ticks_of_robot()
    ticks.update(SE2(3.0, 1.0, 0.5), 10**9)
    before = ticks.update(SE2(3.005, 1.002, 0.51), 10**9 + STEP_NS)
    assert ticks.update(SE2(0.0, 0.0, 0.0), 10**9 + 2 * STEP_NS) == before and ticks.restarts == 1
    after = ticks.update(SE2(0.01, 0.0, 0.0), 10**9 + 3 * STEP_NS)
    assert after[0] > before[0] and after[1] > before[1]


def test_time_that_runs_backwards_moves_no_wheel() -> None:
    ticks = ticks_of_robot()
    ticks.update(SE2(0.0, 0.0, 0.0), 10**9)
    assert ticks.update(SE2(0.5, 0.0, 0.0), 10**8) == (0, 0) and ticks.restarts == 1
