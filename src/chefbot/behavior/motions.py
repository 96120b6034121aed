"""Behaviors: spin, drive straight (forwards or backwards) and wait."""

from __future__ import annotations

import math

from chefbot.behavior.behavior import BehaviorProgress, BehaviorStep, free_ahead
from chefbot.maths.angles import wrap
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2

PLANNED_BRAKING_FRACTION = 0.5
"""Fraction of the maximum acceleration that planned braking uses."""
MIN_SPEED, MIN_TURN_RATE = 0.02, 0.1
"""Minimum speed and turn rate at the end of a motion, m/s and rad/s; below that static friction stops the wheels."""
DISTANCE_TOLERANCE, ANGLE_TOLERANCE = 0.01, 0.03
"""Goal tolerances, m and rad."""
MARGIN, ANGLE_MARGIN = 0.05, 0.1
"""Free distance (m) and angle (rad) required beyond the braking distance."""


class Spin:
    """Rotates in place by `angle` radians (positive: left; more than one turn is possible).

    A disc that rotates about its centre cannot collide; any other footprint must be free over the braking angle.
    """

    def __init__(self, angle: float, turn: float, turn_acceleration: float, timeout: float = 30.0) -> None:
        self.angle, self.turn, self.turn_acceleration, self.timeout = angle, turn, turn_acceleration, timeout
        self.turned = self._elapsed = 0.0
        """Angle rotated so far, rad, positive: left."""
        self._last_yaw: float | None = None

    def update(self, pose: SE2, costmap: Costmap, dt: float) -> BehaviorStep:
        """Return the next turn rate; DONE within the angle tolerance, BLOCKED by an obstacle, TIMED_OUT after the
        timeout."""
        self.turned += wrap(pose.yaw - self._last_yaw) if self._last_yaw is not None else 0.0
        self._last_yaw = pose.yaw
        self._elapsed += dt
        remaining = self.angle - self.turned
        if abs(remaining) <= ANGLE_TOLERANCE or remaining * self.angle <= 0.0:
            return BehaviorStep(0.0, 0.0, BehaviorProgress.DONE)
        if self._elapsed > self.timeout:
            return BehaviorStep(0.0, 0.0, BehaviorProgress.TIMED_OUT)
        rate = self._planned_rate(abs(remaining))
        braking = rate * rate / (2.0 * PLANNED_BRAKING_FRACTION * self.turn_acceleration) + rate * dt
        check_angle = math.copysign(min(abs(remaining), braking + ANGLE_MARGIN), remaining)
        if costmap.comes_nearer_by_rotating(pose, check_angle):
            return BehaviorStep(0.0, 0.0, BehaviorProgress.BLOCKED)
        return BehaviorStep(0.0, math.copysign(rate, remaining), BehaviorProgress.RUNNING)

    def _planned_rate(self, remaining: float) -> float:
        # the turn rate from which planned braking stops at the target
        rate = min(self.turn, math.sqrt(2.0 * PLANNED_BRAKING_FRACTION * self.turn_acceleration * remaining))
        return max(rate, MIN_TURN_RATE)


class DriveStraight:
    """Drives `distance` metres (negative: backwards) straight, holding the initial heading."""

    HOLD = 1.5
    """Gain of the heading controller, rad/s per rad."""

    def __init__(self, distance: float, speed: float, acceleration: float, timeout: float = 30.0) -> None:
        self.distance, self.speed, self.acceleration, self.timeout = distance, speed, acceleration, timeout
        self.driven = 0.0
        """Distance driven so far, m, negative: backwards."""
        self._start: SE2 | None = None
        self._elapsed = 0.0

    def update(self, pose: SE2, costmap: Costmap, dt: float) -> BehaviorStep:
        """Return the next speed with a heading correction; BLOCKED if the braking distance is not free."""
        self._start = start = self._start or pose
        self._elapsed += dt
        sign = math.copysign(1.0, self.distance)
        self.driven = start.between(pose).x
        remaining = abs(self.distance) - sign * self.driven
        if remaining <= DISTANCE_TOLERANCE:
            return BehaviorStep(0.0, 0.0, BehaviorProgress.DONE)
        if self._elapsed > self.timeout:
            return BehaviorStep(0.0, 0.0, BehaviorProgress.TIMED_OUT)
        speed = self._planned_speed(remaining)
        # stop if braking distance plus margin is not free
        check_distance = min(
            remaining,
            speed * speed / (2.0 * PLANNED_BRAKING_FRACTION * self.acceleration) + speed * dt + MARGIN,
        )
        if not free_ahead(costmap, pose, sign * check_distance):
            return BehaviorStep(0.0, 0.0, BehaviorProgress.BLOCKED)
        return BehaviorStep(sign * speed, self.HOLD * wrap(start.yaw - pose.yaw), BehaviorProgress.RUNNING)

    def _planned_speed(self, remaining: float) -> float:
        # the speed from which planned braking stops at the target: v^2 = 2 a d
        speed = min(self.speed, math.sqrt(2.0 * PLANNED_BRAKING_FRACTION * self.acceleration * remaining))
        return max(speed, MIN_SPEED)
