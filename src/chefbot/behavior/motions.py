"""The four motions: spin, straight (forwards or backwards), wait."""

from __future__ import annotations

import math

from chefbot.behavior.behavior import Progress, Step, free_ahead
from chefbot.maths.angles import wrap
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2

GENTLE = 0.5
"""Share of the acceleration used for braking at the end."""
CREEP_SPEED, CREEP_TURN = 0.02, 0.1
"""Slowest twist at the end of a motion, m/s and rad/s; slower the wheels would stick."""
CLOSE_ENOUGH, TURNED_ENOUGH = 0.01, 0.03
"""Metres and radians short of the target that count as done."""
MARGIN = 0.05
"""Metres kept free beyond the braking distance."""


class Spin:
    """Turn on the spot by `angle` radians (positive: left; more than a turn is fine).

    A disk that turns about its centre touches nothing it does not touch already, so the costmap is not asked.
    """

    def __init__(self, angle: float, turn: float, turn_acceleration: float, timeout: float = 30.0) -> None:
        self.angle, self.turn, self.turn_acceleration, self.timeout = angle, turn, turn_acceleration, timeout
        self.turned = self._elapsed = 0.0
        """Radians so far, positive: left."""
        self._last: float | None = None

    def update(self, pose: SE2, costmap: Costmap, dt: float) -> Step:  # noqa: ARG002
        """See `Behavior`."""
        self.turned += wrap(pose.yaw - self._last) if self._last is not None else 0.0
        self._last = pose.yaw
        self._elapsed += dt
        left = self.angle - self.turned
        if abs(left) <= TURNED_ENOUGH or left * self.angle <= 0.0:
            return Step(0.0, 0.0, Progress.DONE)
        if self._elapsed > self.timeout:
            return Step(0.0, 0.0, Progress.TIMED_OUT)
        rate = min(self.turn, math.sqrt(2.0 * GENTLE * self.turn_acceleration * abs(left)))
        return Step(0.0, math.copysign(max(rate, CREEP_TURN), left), Progress.RUNNING)


class Straight:
    """Drive `distance` metres along the heading it has at the start (negative: backwards), holding that
    heading."""

    HOLD = 1.5
    """rad/s of turn per radian off the heading."""

    def __init__(self, distance: float, speed: float, acceleration: float, timeout: float = 30.0) -> None:
        self.distance, self.speed, self.acceleration, self.timeout = distance, speed, acceleration, timeout
        self.driven = 0.0
        """Metres so far, negative: backwards."""
        self._start: SE2 | None = None
        self._elapsed = 0.0

    def update(self, pose: SE2, costmap: Costmap, dt: float) -> Step:
        """See `Behavior`."""
        self._start = start = self._start or pose
        self._elapsed += dt
        sign = math.copysign(1.0, self.distance)
        self.driven = start.between(pose).x
        left = abs(self.distance) - sign * self.driven
        if left <= CLOSE_ENOUGH:
            return Step(0.0, 0.0, Progress.DONE)
        if self._elapsed > self.timeout:
            return Step(0.0, 0.0, Progress.TIMED_OUT)
        speed = max(min(self.speed, math.sqrt(2.0 * GENTLE * self.acceleration * left)), CREEP_SPEED)
        reach = min(left, speed * speed / (2.0 * GENTLE * self.acceleration) + speed * dt + MARGIN)
        if not free_ahead(costmap, pose, sign * reach):
            return Step(0.0, 0.0, Progress.BLOCKED)
        return Step(sign * speed, self.HOLD * wrap(start.yaw - pose.yaw), Progress.RUNNING)


class Wait:
    """Stand still for `duration` seconds."""

    def __init__(self, duration: float) -> None:
        self.duration = duration
        self._elapsed = 0.0

    def update(self, pose: SE2, costmap: Costmap, dt: float) -> Step:  # noqa: ARG002
        """See `Behavior`."""
        self._elapsed += dt
        return Step(0.0, 0.0, Progress.DONE if self._elapsed >= self.duration else Progress.RUNNING)
