"""The predicted trajectory: arcs after a ramp within the robot's accelerations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.trajectory import TIME_STEP, predicted_trajectory
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits

LIMITS = Limits.of(load_robot("chefbot"))
POSE = SE2(1.0, -2.0, 0.7)
SPEEDS = st.floats(-0.5, 0.5)
RATES = st.floats(-1.5, 1.5)


@given(SPEEDS, RATES, st.floats(0.3, 3.0))
def test_a_steady_twist_gives_an_arc(v: float, w: float, duration: float) -> None:
    trajectory = predicted_trajectory(POSE, (v, w), (v, w), LIMITS, duration, math.inf)
    time = TIME_STEP * (len(trajectory) - 1)
    assert time == pytest.approx(duration, abs=TIME_STEP / 2 + 1e-9)
    chord = v * time * np.sinc(w * time / (2.0 * np.pi))
    end = POSE @ SE2(chord * math.cos(w * time / 2), chord * math.sin(w * time / 2), 0.0)
    assert trajectory[-1] == pytest.approx([end.x, end.y, POSE.yaw + w * time], abs=1e-9)


@given(SPEEDS, RATES, SPEEDS, RATES)
def test_no_step_exceeds_the_accelerations(v: float, w: float, target_v: float, target_w: float) -> None:
    trajectory = predicted_trajectory(POSE, (v, w), (target_v, target_w), LIMITS, 2.0, math.inf)
    turn_rates = np.diff(trajectory[:, 2]) / TIME_STEP
    assert np.abs(np.diff(turn_rates)).max() <= LIMITS.angular_acceleration * TIME_STEP + 1e-9
    assert abs(turn_rates[0] - w) <= LIMITS.angular_acceleration * TIME_STEP / 2 + 1e-9
    speeds = np.hypot(*np.diff(trajectory[:, :2], axis=0).T) / TIME_STEP
    assert speeds.max() <= max(abs(v), abs(target_v)) + 1e-9


@given(st.floats(0.0, 0.4))
def test_it_ends_at_the_goal(distance: float) -> None:
    trajectory = predicted_trajectory(POSE, (0.3, 0.0), (0.3, 0.0), LIMITS, 3.0, distance)
    driven = math.hypot(*(trajectory[-1, :2] - trajectory[0, :2]))
    assert distance - 1e-9 <= driven <= distance + 0.3 * TIME_STEP + 1e-9
