"""Retreat along the robot's own track, to where its depth camera sees again what is too near for it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.robot.sensors import DepthCamera

SPACING = 0.03
"""Distance between two poses of the track, m."""
TRACK_TIME_NS = 25_000_000_000
"""Time for which the track is kept, ns: ground that the body covered longer ago may be taken, and the collision
monitor does not let the robot back over it (its parameter `ground_memory_time`)."""
SEEN_TRACK_TIME_NS = 120_000_000_000
"""The same for a robot that sees what is behind it, ns: a few turns in place and a wait are no new place."""
STEP = 0.01
"""Distance between two points of the track at which the retreat may end, m."""
MAX_RETREAT = 0.5
"""Maximum distance of a retreat, m: it needs no localization, and without it the robot drives no farther."""
SIGHT_MARGIN = 0.1
"""Distance beyond the camera's minimum range from which a place is seen well, m."""


class Retreat(NamedTuple):
    """A retreat: first a rotation in place (rad), then backwards by a distance (m), then a rotation to the place."""

    turn: float
    distance: float
    turn_to_place: float


class RecentTrack:
    """The robot's poses of the last `time_ns` nanoseconds, in odom."""

    def __init__(self, time_ns: int = TRACK_TIME_NS) -> None:
        self._time_ns = time_ns
        self._poses: deque[tuple[int, SE2]] = deque()

    def add(self, pose: SE2, now_ns: int) -> None:
        """Add the present pose, unless the robot has not moved since the last one, and drop the oldest ones."""
        if not self._poses or self._poses[-1][1].distance(pose) >= SPACING:
            self._poses.append((now_ns, pose))
        while self._poses and now_ns - self._poses[0][0] > self._time_ns:
            self._poses.popleft()

    def retreat(self, robot: SE2, x: float, y: float, sight: float) -> Retreat | None:
        """Return the shortest retreat from `robot` after which (x, y) is `sight` metres away or more.

        None if the track does not lead that far, or if the place is that far away already.
        """
        if math.hypot(x - robot.x, y - robot.y) >= sight:
            return None
        for back_x, back_y in self._points_back_from(robot):
            distance = math.hypot(robot.x - back_x, robot.y - back_y)
            if distance > MAX_RETREAT:
                return None
            if math.hypot(x - back_x, y - back_y) >= sight:
                ahead = math.atan2(robot.y - back_y, robot.x - back_x)
                to_place = math.atan2(y - back_y, x - back_x)
                return Retreat(wrap(ahead - robot.yaw), distance, wrap(to_place - ahead))
        return None

    def _points_back_from(self, robot: SE2) -> Iterator[tuple[float, float]]:
        """Yield points of the track from the robot back, closely: between two poses it may come into sight."""
        x, y = robot.x, robot.y
        for _, pose in reversed(self._poses):
            steps = math.ceil(math.hypot(pose.x - x, pose.y - y) / STEP)
            for i in range(1, steps + 1):
                yield x + (pose.x - x) * i / steps, y + (pose.y - y) * i / steps
            x, y = pose.x, pose.y


def sight_distance(camera: DepthCamera) -> float:
    """Return the distance from base_link at which the camera sees a place that the robot faces, m."""
    return camera.mount.x + camera.range_min + SIGHT_MARGIN
