"""Waypoints: their order over all rounds, those that were missed, and poses to drive through without a stop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import COMPLETED, FAILED, PENDING, SKIPPED, FollowWaypoints_Result, WaypointStatus

UNKNOWN, NO_VALID_WAYPOINTS, STOP_ON_MISSED_WAYPOINT = 600, 602, 603
"""Error codes of nav2_msgs/action/FollowWaypoints."""
ENDLESS_LOOPS = 2**32 - 1
"""Number of loops of a patrol that only ends when it is cancelled: the largest that the field can hold."""
PASSING_PATH_FACTOR = 2.0
"""Length of the path to a pose, in passing radii, up to which the pose counts as passed: not one beyond a wall."""


class WaypointFollowerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the waypoint follower, with Nav2's names; times are in seconds here."""

    stop_on_failure: Annotated[
        bool,
        Meta(description="whether a waypoint that is missed ends the action; otherwise the next one follows"),
    ] = False
    waypoint_pause_duration: Annotated[
        float, Meta(ge=0.0, le=3600.0, description="time for which the robot waits at each waypoint, s")
    ] = 0.2


class WaypointRun:
    """The waypoints of one goal: which is next, and which were missed.

    poses: the waypoints. goal_index: the first one of the first round. number_of_loops: rounds after the first.
    A round in which no waypoint was reached is the last one.
    """

    def __init__(self, poses: Sequence[PoseStamped], goal_index: int, number_of_loops: int) -> None:
        self._poses, self.number_of_loops = poses, number_of_loops
        self.index, self.loop = goal_index, 0
        self._missed: dict[int, WaypointStatus] = {}
        self._reached = self._reached_now = 0

    @property
    def failure_reason(self) -> str:
        """Why there is no waypoint to drive to; empty if there is one."""
        if not self._poses:
            return "The list of waypoints is empty."
        if self.index >= len(self._poses):
            return f"There are {len(self._poses)} waypoints, so number {self.index} cannot be the first."
        return ""

    @property
    def pose(self) -> PoseStamped:
        """The waypoint to drive to."""
        return self._poses[self.index]

    def reached(self) -> bool:
        """Count the waypoint as reached and advance to the next; return whether there is one."""
        self._reached += 1
        self._reached_now += 1
        return self._advance()

    def missed(self, error_code: int, error_msg: str) -> bool:
        """Count the waypoint as missed and advance to the next; return whether there is one."""
        self._missed[self.index] = WaypointStatus(FAILED, self.index, self.pose, error_code, error_msg)
        return self._advance()

    def _advance(self) -> bool:
        self.index += 1
        if self.index < len(self._poses):
            return True
        if self.loop >= self.number_of_loops or not self._reached_now:
            return False
        self.index, self._reached_now = 0, 0
        self.loop += 1
        return True

    def result(self, *, stopped: bool) -> FollowWaypoints_Result:
        """Return the result after the last waypoint, or after a missed one that ends the run (`stopped`)."""
        missed = tuple(self._missed[index] for index in sorted(self._missed))
        last = missed[-1].error_msg if missed else ""
        if stopped:
            sentence = f"Waypoint {missed[-1].waypoint_index} was missed: {last}"
            return FollowWaypoints_Result(missed, STOP_ON_MISSED_WAYPOINT, sentence)
        if missed and not self._reached_now:
            return FollowWaypoints_Result(missed, UNKNOWN, f"No waypoint of this round was reached: {last}")
        return FollowWaypoints_Result(missed)


class PosesToPass:
    """Poses to drive through: which one is next, and how far the robot is from the last.

    poses: (x, y, yaw) in the map frame, at least one. radius: distance from a pose at which it counts as passed, m;
    the last one has to be reached. With it the robot need not slow down at a pose (Nav2: RemovePassedGoals).
    """

    def __init__(self, poses: Sequence[PoseStamped], radius: float) -> None:
        self._poses, self._radius = poses, radius
        self.index = 0

    @property
    def pose(self) -> PoseStamped:
        """The pose to drive to."""
        return self._poses[self.index]

    @property
    def remaining(self) -> int:
        """Number of poses that are neither passed nor reached."""
        return len(self._poses) - self.index

    def passes(self, robot: SE2, path_length: float) -> bool:
        """Return whether the next pose counts as passed, `path_length` metres before it, and advance if so."""
        near = robot.distance(self.pose.pose.se2) <= self._radius
        if self.remaining <= 1 or not near or path_length > PASSING_PATH_FACTOR * self._radius:
            return False
        self.index += 1
        return True

    def distance_after(self) -> float:
        """Return the length of the polyline from the next pose to the last, m."""
        points = [pose.pose.position for pose in self._poses[self.index :]]
        return sum(math.hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(points))

    def statuses(
        self, error_code: int = 0, error_msg: str = "", *, ended: bool
    ) -> tuple[WaypointStatus, ...]:
        """Return the status of each pose, during the run or after its end."""
        last = FAILED if error_code else COMPLETED
        return tuple(
            WaypointStatus(COMPLETED, i, pose)
            if i < self.index
            else WaypointStatus(last, i, pose, error_code, error_msg)
            if ended and i == self.index
            else WaypointStatus(SKIPPED if ended else PENDING, i, pose)
            for i, pose in enumerate(self._poses)
        )
