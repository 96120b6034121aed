"""Ticks of both wheels from the odometry of a base that publishes no ticks."""

from __future__ import annotations

import math

from chefbot.control.kinematics import wheel_speeds
from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot

MARGIN = 1.5
"""Ratio of the fastest believed motion to the robot's maximum speeds."""
SLACK = 0.02
"""Motion that is always believed, m and rad: that of a late message."""


class OdometryTicks:
    """Turns poses into the ticks that the wheels of the robot file would count on the same path.

    So odometry, calibration and fault detection are those of every robot. A pose that the robot cannot have reached
    is that of a base that has begun again: the ticks continue from there.
    """

    def __init__(self, robot: Robot, max_speed: float, max_turn: float) -> None:
        """max_speed, max_turn: of the robot, m/s and rad/s."""
        self._robot, self._limits = robot, (max_speed, max_turn)
        self._pose: SE2 | None = None
        self._stamp_ns = 0
        self._turns = [0.0, 0.0]  # of the wheels, rad
        self.restarts = 0
        """Number of poses that the robot cannot have reached."""

    def update(self, pose: SE2, stamp_ns: int) -> tuple[int, int]:
        """Return the ticks (left, right) at a pose of the robot in the frame of its odometry."""
        previous, self._pose = self._pose, pose
        seconds, self._stamp_ns = (stamp_ns - self._stamp_ns) / 1e9, stamp_ns
        if previous is not None:
            motion = previous.between(pose)
            if self._believed(motion, seconds):
                self._roll(motion)
            else:
                self.restarts += 1
        left, right = (round(turn * self._robot.motor.ticks_per_radian) for turn in self._turns)
        return left, right

    def _believed(self, motion: SE2, seconds: float) -> bool:
        speed, turn = (MARGIN * limit * max(seconds, 0.0) + SLACK for limit in self._limits)
        return math.hypot(motion.x, motion.y) <= speed and abs(motion.yaw) <= turn

    def _roll(self, motion: SE2) -> None:
        """Turn the wheels along the arc to a pose in the frame of the one before."""
        half = motion.yaw / 2.0
        # A chord and its arc: length / chord = half angle / sin(half angle)
        straightness = math.sin(half) / half if abs(half) > 1e-6 else 1.0
        along = (motion.x * math.cos(half) + motion.y * math.sin(half)) / straightness
        for wheel, turn in enumerate(wheel_speeds(along, motion.yaw, self._robot)):  # in one unit of time
            self._turns[wheel] += turn
