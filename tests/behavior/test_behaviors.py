import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.behavior.behavior import BehaviorProgress, free_ahead
from chefbot.behavior.motions import DriveStraight, Spin
from chefbot.maths.costs import INSCRIBED, LETHAL, Costmap
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import max_acceleration, max_turn, max_turn_acceleration

ROBOT = load_robot("chefbot")
DT = 0.05


def floor():
    return Costmap(np.zeros((100, 100), np.uint8), 0.05, -2.5, -2.5)


def run(behavior, costmap, pose=SE2(0.0, 0.0, 0.3), limit=4000):  # noqa: B008
    """(end pose, turned, last progress) of a unicycle that obeys at once."""
    turned = 0.0
    for _ in range(limit):
        v, w, progress = behavior.update(pose, costmap, DT)
        if progress is not BehaviorProgress.RUNNING:
            assert (v, w) == (0.0, 0.0)
            return pose, turned, progress
        pose = pose @ SE2(v * DT, 0.0, w * DT)
        turned += w * DT
    raise AssertionError("it never ends")


@settings(max_examples=30)
@given(st.floats(0.1, 12.0), st.sampled_from([-1, 1]))
def test_spin_turns_by_its_angle(angle, sign):
    spin = Spin(sign * angle, max_turn(ROBOT), max_turn_acceleration(ROBOT))
    _, turned, progress = run(spin, floor())
    assert progress is BehaviorProgress.DONE
    assert turned == pytest.approx(sign * angle, abs=0.05)
    assert spin.turned == pytest.approx(turned), "it knows"


@settings(max_examples=30)
@given(st.floats(0.05, 1.5), st.sampled_from([-1, 1]), st.floats(-3.1, 3.1))
def test_drive_straight_covers_its_distance(distance, sign, yaw):
    start = SE2(0.0, 0.0, yaw)
    straight = DriveStraight(sign * distance, 0.2, max_acceleration(ROBOT))
    pose, _, progress = run(straight, floor(), start)
    assert progress is BehaviorProgress.DONE
    assert start.between(pose).x == pytest.approx(sign * distance, abs=0.025)
    assert straight.driven == pytest.approx(start.between(pose).x), "it knows"


@settings(max_examples=30)
@given(st.floats(0.3, 1.0), st.sampled_from([-1, 1]))
def test_drive_straight_stops_before_an_obstacle(gap, sign):
    costmap = floor()
    column = costmap.cell(sign * gap, 0.0)[1]
    costmap.cells[:, column : column + 1] = INSCRIBED
    pose, _, progress = run(
        DriveStraight(sign * 1.5, 0.3, max_acceleration(ROBOT)), costmap, SE2(0.0, 0.0, 0.0)
    )
    assert progress is BehaviorProgress.BLOCKED
    assert costmap.at(pose.x, pose.y) == 0


def test_motion_may_leave_the_inscribed_zone_but_hits_no_wall():
    costmap = floor()
    costmap.cells[:, 48:52] = INSCRIBED
    assert free_ahead(costmap, SE2(0.0, 0.0, math.pi), 0.4)
    costmap.cells[:, 46] = LETHAL
    assert not free_ahead(costmap, SE2(0.0, 0.0, math.pi), 0.4)
    assert free_ahead(costmap, SE2(0.0, 0.0, math.pi), -0.4)


def test_a_robot_that_cannot_move_times_out():
    straight = DriveStraight(0.5, 0.2, max_acceleration(ROBOT), timeout=1.0)
    steps = [straight.update(SE2(0.0, 0.0, 0.0), floor(), DT).progress for _ in range(30)]
    assert steps[10] is BehaviorProgress.RUNNING
    assert steps[-1] is BehaviorProgress.TIMED_OUT
