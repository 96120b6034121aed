"""Motions for the goals of Nav2's behavior actions: Spin, BackUp and DriveOnHeading."""

from __future__ import annotations

from chefbot.behavior.motions import DriveStraight, Spin
from chefbot.errors import ChefbotError
from chefbot.msgs.nav2_msgs import BackUp_Goal, DriveOnHeading_Goal, Spin_Goal
from chefbot.robot.motion_limits import max_acceleration, max_speed, max_turn, max_turn_acceleration
from chefbot.robot.spec import Robot

DEFAULT_TIME_ALLOWANCE = 30.0
"""Time allowance of a motion whose goal has none, s."""

StraightGoal = BackUp_Goal | DriveOnHeading_Goal


class InvalidMotionError(ChefbotError):
    """Raised for a goal that no motion can reach; the message is the reason."""


def spin_motion(goal: Spin_Goal, robot: Robot) -> Spin:
    """Return a rotation in place by target_yaw, rad."""
    allowance = goal.time_allowance.seconds or DEFAULT_TIME_ALLOWANCE
    return Spin(float(goal.target_yaw), max_turn(robot), max_turn_acceleration(robot), allowance)


def back_up_motion(goal: BackUp_Goal, robot: Robot) -> DriveStraight:
    """Return a motion backwards by target.x metres, whatever its sign (nav2_behaviors back_up.cpp).

    Raises InvalidMotionError if the target is not straight behind.
    """
    return _straight_motion(-abs(goal.target.x), goal, robot)


def heading_motion(goal: DriveOnHeading_Goal, robot: Robot) -> DriveStraight:
    """Return a straight motion by target.x metres, negative is backwards.

    Raises InvalidMotionError if the speed has another sign, or if the target is not straight ahead or behind.
    """
    if goal.target.x * goal.speed < 0.0:
        raise InvalidMotionError("Distance and speed must have the same sign.")
    return _straight_motion(goal.target.x, goal, robot)


def _straight_motion(distance: float, goal: StraightGoal, robot: Robot) -> DriveStraight:
    if goal.target.y or goal.target.z:
        raise InvalidMotionError("Only straight motions are supported: target.y and target.z must be 0.")
    speed = min(abs(float(goal.speed)) or max_speed(robot), max_speed(robot))
    allowance = goal.time_allowance.seconds or DEFAULT_TIME_ALLOWANCE
    return DriveStraight(distance, speed, max_acceleration(robot), allowance)
