"""The final approach to a goal with tight tolerances: straight to the point at creeping speed, then the turn."""

from __future__ import annotations

import math
from enum import Enum

import numpy as np

from chefbot.control.controller import ControllerCommand, ControllerStatus
from chefbot.control.goal_checkers import GoalParams
from chefbot.maths.angles import wrap
from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.se2 import SE2
from chefbot.robot.motion_limits import Limits

BEGIN_DISTANCE, END_DISTANCE = 0.35, 0.6
"""Distances from the goal at which the final approach begins, and beyond which it is left again, m."""
MAX_SPEED = 0.15
"""Highest speed, m/s."""
MIN_SPEED, MIN_TURN_RATE = 0.02, 0.06
"""Lowest speeds that the wheels keep up, m/s and rad/s."""
MAX_REVERSE_DISTANCE = 0.12
"""Distance up to which a goal behind the robot is reached backwards, m: over floor that it has just driven over."""
TURN_BEGIN_ANGLE, TURN_END_ANGLE = 0.15, 0.04
"""Errors of the direction to the goal from which the robot turns in place, and at which it drives again, rad."""
STEERING_GAIN = 2.5
"""Turn rate per error of the direction, 1/s."""
STEERING_DISTANCE = 0.08
"""Distance below which it steers less, as the direction to a point so near is mostly noise, m."""
LATENCY = 0.15
"""Time from a command to the motion, s; what the robot turns or drives in it is subtracted."""
BRAKING_FRACTION = 0.5
"""Fraction of the maximum accelerations that planned braking uses."""
TOLERANCE_FRACTION = 0.5
"""Fraction of the tolerances at which a phase ends: the pose estimate still changes a little."""
STANDSTILL_SPEED = 0.02
"""Speeds below which the robot stands, m/s and rad/s."""


class Phase(Enum):
    """Phases of the final approach."""

    DRIVE = "driving to the point"
    TURN = "turning to the heading"


class FinalApproach:
    """Reaches a goal within given tolerances, without the manoeuvres of a controller that misses the point.

    It turns to the point, drives straight to it at creeping speed, forwards or a short distance backwards, turns to
    the goal's heading, and stands before it reports REACHED. If the pose estimate has moved out of tolerance
    meanwhile, it begins again. It is active only while the robot's centre may be anywhere on the straight line to the
    point; otherwise the controller of the path continues.
    """

    def __init__(self, limits: Limits, period: float) -> None:
        self._limits, self._period = limits, period
        self._tolerance: GoalParams | None = None
        self.reset(None)

    def reset(self, tolerance: GoalParams | None) -> None:
        """Begin with a new goal; without tolerances there is no final approach to it."""
        self._tolerance = tolerance
        self._active = self._turning = False
        self._phase = Phase.DRIVE

    @property
    def is_wanted(self) -> bool:
        """Whether the goal has tolerances of its own, so that nothing else may report it as reached."""
        return self._tolerance is not None

    def is_active(self, pose: SE2, goal: SE2, costmap: Costmap) -> bool:
        """Return whether the robot is in the final approach: near the goal, with a free straight path to it."""
        near = pose.distance(goal) <= (END_DISTANCE if self._active else BEGIN_DISTANCE)
        self._active = self.is_wanted and near and _is_free(costmap, pose, goal)
        return self._active

    def command(
        self, pose: SE2, twist: tuple[float, float], goal: SE2, costmap: Costmap
    ) -> ControllerCommand:
        """Return the twist to ramp to. Pose, goal and costmap are in one frame; `twist` is the present one."""
        assert self._tolerance is not None
        if self._phase is Phase.DRIVE and self._at_point(pose, goal):
            self._phase = Phase.TURN
        if self._phase is Phase.DRIVE:
            return self._drive(pose, twist, goal, costmap)
        angle = wrap(goal.yaw - pose.yaw)
        if abs(angle) > TOLERANCE_FRACTION * self._tolerance.yaw_tolerance:
            return self._turn(pose, twist, angle, costmap)
        if max(abs(twist[0]), abs(twist[1])) > STANDSTILL_SPEED:
            return ControllerCommand(0.0, 0.0, ControllerStatus.RUNNING)
        if pose.distance(goal) <= self._tolerance.xy_tolerance:
            return ControllerCommand(0.0, 0.0, ControllerStatus.REACHED)
        self._phase = Phase.DRIVE
        return self._drive(pose, twist, goal, costmap)

    def _at_point(self, pose: SE2, goal: SE2) -> bool:
        """Return whether the point is reached, or passed within tolerance."""
        assert self._tolerance is not None
        ahead = pose.between(goal)
        away = math.hypot(ahead.x, ahead.y)
        passed = (
            abs(ahead.x) < abs(ahead.y)
            and away <= (1.0 + TOLERANCE_FRACTION) / 2.0 * self._tolerance.xy_tolerance
        )
        return away <= TOLERANCE_FRACTION * self._tolerance.xy_tolerance or passed

    def _drive(self, pose: SE2, twist: tuple[float, float], goal: SE2, costmap: Costmap) -> ControllerCommand:
        """Turn to the point if it is far off the heading, else drive to it."""
        ahead = pose.between(goal)
        away, bearing = math.hypot(ahead.x, ahead.y), math.atan2(ahead.y, ahead.x)
        backwards = abs(bearing) > math.pi / 2 and away <= MAX_REVERSE_DISTANCE
        error = wrap(bearing - math.pi) if backwards else bearing
        self._turning = abs(error) > (TURN_END_ANGLE if self._turning else TURN_BEGIN_ANGLE)
        if self._turning:
            return self._turn(pose, twist, error, costmap)
        rest = max(abs(ahead.x) - abs(twist[0]) * LATENCY, 0.0)
        speed = min(
            MAX_SPEED,
            self._limits.speed,
            math.sqrt(2.0 * BRAKING_FRACTION * self._limits.acceleration * rest),
        )
        v = math.copysign(max(speed, MIN_SPEED), -1.0 if backwards else 1.0)
        w = STEERING_GAIN * error * min(1.0, away / STEERING_DISTANCE)
        return ControllerCommand(v, w, ControllerStatus.RUNNING)

    def _turn(
        self, pose: SE2, twist: tuple[float, float], angle: float, costmap: Costmap
    ) -> ControllerCommand:
        """Turn in place by an angle, at a rate from which the base stops in time."""
        if costmap.comes_nearer_by_rotating(pose, angle):
            return ControllerCommand(0.0, 0.0, ControllerStatus.BLOCKED)
        rest = max(abs(angle) - abs(twist[1]) * LATENCY, 0.0)
        fastest = math.sqrt(2.0 * BRAKING_FRACTION * self._limits.angular_acceleration * rest)
        rate = max(min(self._limits.angular_speed, fastest), MIN_TURN_RATE)
        w = math.copysign(rate, angle)
        return ControllerCommand(0.0, w * self._limits.scale(0.0, w), ControllerStatus.RUNNING)


def _is_free(costmap: Costmap, pose: SE2, goal: SE2) -> bool:
    """Return whether the robot's centre may be anywhere between the pose and the goal; the start may be inscribed."""
    count = max(2, math.ceil(2.0 * pose.distance(goal) / costmap.resolution))
    poses = [
        SE2(pose.x + share * (goal.x - pose.x), pose.y + share * (goal.y - pose.y), pose.yaw)
        for share in np.linspace(0.0, 1.0, count)
    ]
    starts_inscribed = costmap.at(pose.x, pose.y) >= INSCRIBED
    enters = any(costmap.at(ahead.x, ahead.y) >= INSCRIBED for ahead in poses[1:]) and not starts_inscribed
    return not (enters or costmap.comes_nearer(poses))
