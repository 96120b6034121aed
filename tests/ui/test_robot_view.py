"""Tests of the robot's view: what a robot at rest shows, and what its motion shows."""

from __future__ import annotations

import math

import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Twist
from chefbot.ui.display.robot_view import robot_view

REST = Twist()
SHOWN = robot_view(SE2(1.0, 2.0, math.pi), REST)


def test_noise_of_the_pose_at_rest_is_nothing_new() -> None:
    view = SHOWN
    for step in range(50):
        view = robot_view(
            SE2(1.0 + 0.002 * math.sin(step), 2.0, -math.pi + 0.002 * math.cos(step)), REST, view
        )
    assert view is SHOWN


@pytest.mark.parametrize("pose", [SE2(1.004, 2.0, math.pi), SE2(1.0, 1.996, math.pi), SE2(1.0, 2.0, 3.137)])
def test_a_robot_at_rest_moves_if_its_estimate_jumps(pose: SE2) -> None:
    view = robot_view(pose, REST, SHOWN)
    assert (view.x, view.y) == (pose.x, pose.y) and view.yaw == pytest.approx(pose.yaw, abs=0.0006)


def test_a_drift_of_the_estimate_adds_up() -> None:
    view = SHOWN
    for step in range(1, 10):
        view = robot_view(SE2(1.0 + 0.001 * step, 2.0, math.pi), REST, view)
    assert view.x >= 1.006


def test_motion_is_shown_to_the_millimetre() -> None:
    slow = Twist.of(0.02, 0.0)
    driving = robot_view(SE2(1.001, 2.0, math.pi), slow, SHOWN)
    assert (driving.x, driving.v) == (1.001, 0.02)
    assert robot_view(SE2(1.002, 2.0, math.pi), slow, driving).x == 1.002
    assert robot_view(SE2(1.002, 2.0, math.pi), REST, driving).v == 0.0, "it has come to rest"
