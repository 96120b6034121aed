import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.board.wheel_pid import WheelPid
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
PER_TICK = 2 * math.pi / ROBOT.motor.ticks_per_turn


def run(pid, target, seconds, load=0.0, lag=0.08, speed=0.0):
    """A motor with inertia: its speed follows duty * no-load speed - load; returns the speeds."""
    angle, ticks, speeds = 0.0, 0, []
    for _ in range(round(seconds * 100)):
        before = ticks
        ticks = math.floor(angle / PER_TICK)
        duty = pid.update(target, ticks - before, 0.01)
        assert -1.0 <= duty <= 1.0
        drive = duty * ROBOT.motor.no_load_speed
        drag = math.copysign(min(load, abs(drive)), drive)
        speed += (drive - drag - speed) * 0.01 / lag
        angle += speed * 0.01
        speeds.append(speed)
    return speeds


@settings(max_examples=30)
@given(st.floats(0.3, 6.5), st.floats(0.0, 1.0), st.sampled_from([-1, 1]))
def test_pid_reaches_the_speed_under_load(target, load, sign):
    speeds = run(WheelPid(ROBOT), sign * target, 3.0, load)
    assert sum(speeds[-50:]) / 50 == pytest.approx(sign * target, abs=0.03 * target + 0.02)
    assert max(abs(s) for s in speeds) < 1.3 * target + 0.1


def test_a_blocked_wheel_does_not_wind_up():
    pid = WheelPid(ROBOT)
    for _ in range(1000):
        pid.update(6.0, 0, 0.01)
    speeds = run(pid, 3.0, 1.5)
    assert max(speeds) < 7.5
    assert speeds[-1] == pytest.approx(3.0, abs=0.2)


def test_a_stopped_wheel_gets_zero_duty():
    pid = WheelPid(ROBOT)
    run(pid, 3.0, 1.0)
    run(pid, 0.0, 2.0)
    assert pid.update(0.0, 0, 0.01) == 0.0
