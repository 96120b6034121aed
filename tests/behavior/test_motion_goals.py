"""Motions of Nav2's goals, their refusals, and the guard of a robot that is blind ahead."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.behavior.behavior import BehaviorProgress, guarded_step
from chefbot.behavior.motion_goals import (
    DEFAULT_TIME_ALLOWANCE,
    InvalidMotionError,
    back_up_motion,
    heading_motion,
    spin_motion,
)
from chefbot.behavior.motions import DriveStraight
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import BackUp_Goal, DriveOnHeading_Goal, Spin_Goal
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_speed

ROBOT = load_robot("chefbot")
FREE = Costmap(np.zeros((80, 80), np.uint8), 0.05, -2.0, -2.0)
METRES = st.floats(-5.0, 5.0)


@given(METRES, METRES)
def test_backing_up_ignores_the_signs_and_keeps_the_speed_limit(distance: float, speed: float) -> None:
    motion = back_up_motion(BackUp_Goal(Point(distance), speed), ROBOT)
    assert motion.distance == -abs(distance) and 0.0 < motion.speed <= max_speed(ROBOT)


@given(METRES, METRES)
def test_driving_needs_equal_signs(distance: float, speed: float) -> None:
    goal = DriveOnHeading_Goal(Point(distance), speed)
    if distance * goal.speed < 0.0:
        with pytest.raises(InvalidMotionError, match="same sign"):
            heading_motion(goal, ROBOT)
    else:
        assert heading_motion(goal, ROBOT).distance == distance


@pytest.mark.parametrize("target", [Point(0.1, 0.1), Point(0.1, 0.0, 0.1)])
def test_only_straight_motions(target: Point) -> None:
    with pytest.raises(InvalidMotionError, match="straight"):
        back_up_motion(BackUp_Goal(target), ROBOT)
    with pytest.raises(InvalidMotionError, match="straight"):
        heading_motion(DriveOnHeading_Goal(target), ROBOT)


def test_the_time_allowance_has_a_default() -> None:
    assert spin_motion(Spin_Goal(1.0), ROBOT).timeout == DEFAULT_TIME_ALLOWANCE
    assert spin_motion(Spin_Goal(1.0, Duration.of(4.0)), ROBOT).timeout == 4.0


@pytest.mark.parametrize("blind", ["", "The camera is blind."])
@pytest.mark.parametrize("distance", [0.5, -0.5])
def test_a_blind_robot_backs_up_but_does_not_drive_forward(distance: float, blind: str) -> None:
    motion = DriveStraight(distance, 0.2, 0.5)
    step = guarded_step(motion, SE2(0.0, 0.0, 0.0), FREE, 0.1, blind)
    refused = bool(blind) and distance > 0.0
    assert step.progress is (BehaviorProgress.BLOCKED if refused else BehaviorProgress.RUNNING)
    assert step.v == 0.0 if refused else math.copysign(1.0, step.v) == math.copysign(1.0, distance)
