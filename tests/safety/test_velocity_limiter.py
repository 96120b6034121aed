import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.kinematics import wheel_speeds
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.safety.velocity_limiter import VelocityLimiter

ROBOT = load_robot("chefbot")
LIMITS = Limits.of(ROBOT)
anything = st.floats(allow_nan=True, allow_infinity=True)


@given(st.lists(st.tuples(anything, anything, anything, st.floats(0.0, 0.2)), max_size=30))
def test_limiter_never_exceeds_a_limit_for_any_input(commands):
    limiter, last = VelocityLimiter(LIMITS), (0.0, 0.0)
    for v, w, age, dt in commands:
        now = limiter.step(v, w, age, dt)
        assert abs(now[0]) <= LIMITS.speed + 1e-9
        assert abs(now[1]) <= LIMITS.angular_speed + 1e-9
        assert abs(now[0]) + abs(now[1]) * LIMITS.separation / 2 <= LIMITS.wheel_speed + 1e-9
        assert_ramp(last[0], now[0], LIMITS.acceleration * dt, LIMITS.deceleration * dt)
        assert_ramp(last[1], now[1], LIMITS.angular_acceleration * dt, LIMITS.angular_deceleration * dt)
        last = now


def assert_ramp(last, now, max_increase, max_decrease):
    """A speed grows by at most one step, shrinks by at most another, and never reverses in one."""
    assert last * now >= 0.0
    assert abs(now) - abs(last) <= max_increase + 1e-9
    assert abs(last) - abs(now) <= max_decrease + 1e-9


def settle(limiter, v, w, age=0.0):
    for _ in range(100):
        now = limiter.step(v, w, age, 0.05)
    return now


@given(st.floats(0.01, 20.0), st.floats(-20.0, 20.0))
def test_limiting_keeps_the_curvature(v, w):
    got = settle(VelocityLimiter(LIMITS), v, w)
    assert got[1] * v == pytest.approx(w * got[0], abs=1e-9)


@pytest.mark.parametrize(("v", "age"), [(math.nan, 0.0), (math.inf, 0.0), (0.3, 0.31), (0.3, math.nan)])
def test_invalid_and_stale_commands_stop_with_a_reason(v, age):
    limiter = VelocityLimiter(LIMITS)
    settle(limiter, 0.3, 0.0)
    assert settle(limiter, v, 0.0, age) == (0.0, 0.0)
    assert limiter.notice


@given(st.floats(-1, 1), st.floats(-3, 3))
def test_wheel_speeds_give_the_twist(v, w):
    left, right = (speed * ROBOT.wheel_radius for speed in wheel_speeds(v, w, ROBOT))
    assert (left + right) / 2 == pytest.approx(v, abs=1e-9)
    assert (right - left) / ROBOT.wheels.separation == pytest.approx(w, abs=1e-9)


def test_first_step_is_from_standstill_and_reset_stops_at_once():
    limiter = VelocityLimiter(LIMITS)
    v, w = limiter.step(0.35, 0.0, 0.0, 0.05)
    assert (v, w) == (pytest.approx(0.05 * LIMITS.acceleration), 0.0)
    settle(limiter, 0.2, 0.5)
    limiter.reset()
    assert limiter.step(0.0, 0.0, 0.0, 0.05) == (0.0, 0.0)
    limiter.reset(0.1, -0.2)
    assert limiter.step(0.1, -0.2, 0.0, 0.0) == (0.1, -0.2)


@pytest.mark.parametrize(("v", "w"), [(0.3, 0.0), (-0.3, 0.0), (0.0, 1.0), (0.0, -1.0), (0.2, -0.3)])
def test_a_stop_takes_the_time_of_the_deceleration(v, w):
    limiter = VelocityLimiter(LIMITS)
    settle(limiter, v, w)
    braking_time = max(abs(v) / LIMITS.deceleration, abs(w) / LIMITS.angular_deceleration)
    halfway = limiter.step(0.0, 0.0, 0.0, braking_time / 2)
    assert halfway == (pytest.approx(v / 2), pytest.approx(w / 2))
    assert limiter.step(0.0, 0.0, 0.0, braking_time / 2 + 1e-9) == (pytest.approx(0.0), pytest.approx(0.0))


def test_a_reversal_brakes_to_standstill_first():
    limiter = VelocityLimiter(LIMITS)
    settle(limiter, 0.3, 0.0)
    braking_time = 0.3 / LIMITS.deceleration
    assert limiter.step(-0.3, 0.0, 0.0, braking_time + 0.05) == (pytest.approx(0.0), 0.0)
    assert limiter.step(-0.3, 0.0, 0.0, 0.1) == (pytest.approx(-0.1 * LIMITS.acceleration), 0.0)


@pytest.mark.parametrize("dt", [0.0, -1.0, math.nan, math.inf])
def test_in_no_time_the_speed_does_not_change(dt):
    limiter = VelocityLimiter(LIMITS)
    assert limiter.step(0.3, 1.0, 0.0, dt) == (0.0, 0.0)


def test_a_command_that_is_followed_leaves_no_notice():
    limiter = VelocityLimiter(LIMITS)
    assert limiter.notice == ""
    limiter.step(LIMITS.speed, 0.0, 0.3, 0.05)
    assert limiter.notice == ""
    limiter.step(3.0, 0.0, 0.0, 0.05)
    assert "beyond the robot's limits" in limiter.notice and "0.12" in limiter.notice
    limiter.step(0.1, 0.0, 0.31, 0.05)
    assert limiter.notice == "the last command is older than 0.3 s"
    limiter.step(0.1, math.inf, 0.0, 0.05)
    assert limiter.notice == "the commanded twist is not a number"
    limiter.step(0.1, 0.0, 0.0, 0.05)
    assert limiter.notice == ""
