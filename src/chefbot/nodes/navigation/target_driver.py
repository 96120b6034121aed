"""Drives to a target that moves: plans again when it has moved, and follows the newest path without a stop."""

from __future__ import annotations

import math
from typing import Any

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import Node

FRAME = "odom"
"""Frame of the targets: poses in it do not jump."""
REPLAN_DISTANCE, REPLAN_ANGLE = 0.15, 0.3
"""Changes of the target after which a path is planned again, m and rad."""
PATIENCE = 15.0
"""Time without a path that can be followed after which the robot gives up, s."""
TURNS = (math.pi / 2, -math.pi, math.pi / 2)
"""Rotations in which the robot looks round, rad."""
TURN_TIME = 20.0
"""Time in which the behavior server has to complete one of them, s."""


class TargetDriverNode(Node):
    """Base class of a node that drives to moving targets, or looks around."""

    compute_path_to_pose = action_client(nav2.ComputePathToPose)
    follow_path = action_client(nav2.FollowPath)
    spin = action_client(nav2.Spin)

    def start(self) -> None:
        """Start without a target to drive to."""
        self._planning: Future[Any] | None = None
        self._following: Future[Any] | None = None
        self._turning: Future[Any] | None = None
        self._begin()

    def _begin(self) -> None:
        """Reset the state of the last target."""
        self._target: SE2 | None = None
        self._turns = 0
        self._failing_since_ns: int | None = None
        self._fault = ""
        self._diverted = False

    def _drive_to(self, target: SE2) -> None:
        """Drive to a pose in FRAME, with a new plan if it differs from the last one."""
        self._stop_turning()
        if self._planning is not None or (self._target is not None and _same(self._target, target)):
            return
        self._target = target
        goal = PoseStamped(Header.of(self.now_ns, FRAME), Pose.of(target))
        planning = self._planning = self.compute_path_to_pose.call(nav2.ComputePathToPose_Goal(goal))
        planning.add_done_callback(lambda: self._planned(planning))

    def _planned(self, planning: Future[Any]) -> None:
        if planning is not self._planning:
            return  # meanwhile the robot was halted
        self._planning = None
        result = _result(planning)
        if result is None or result.error_code:
            self._note_failure(result.error_msg if result else "Another goal preempted the planner.")
            return
        following = self._following = self.follow_path.call(nav2.FollowPath_Goal(result.path))
        following.add_done_callback(lambda: self._followed(following))

    def _followed(self, following: Future[Any]) -> None:
        if following is not self._following:
            return  # replaced by a newer path
        self._following = None
        result = _result(following)
        if result is None:
            self._diverted = True
        elif result.error_code:
            self._note_failure(result.error_msg)
        else:
            self._failing_since_ns = None

    def _note_failure(self, sentence: str) -> None:
        """Plan again for the next target, and give up after a time without success."""
        self._target = None
        if self._failing_since_ns is None:
            self._failing_since_ns = self.now_ns
        elif self.now_ns - self._failing_since_ns >= PATIENCE * 1e9:
            self._fault = sentence

    def _stand(self) -> None:
        """Stop driving and planning."""
        planning, following = self._planning, self._following
        self._planning = self._following = self._target = None
        self._failing_since_ns = None
        for future in (planning, following):
            if future is not None:
                future.discard()

    def _look_round(self) -> None:
        """Rotate in place to one side, to the other and back, then stand."""
        self._stand()
        if (self._turning is not None and not self._turning.done) or self._turns >= len(TURNS):
            return
        self._turning = self.spin.call(nav2.Spin_Goal(TURNS[self._turns], Duration.of(TURN_TIME)))
        self._turns += 1

    def _stop_turning(self) -> None:
        turning, self._turning, self._turns = self._turning, None, 0
        if turning is not None:
            turning.discard()

    def _halt(self) -> None:
        """Stop planning, following and turning."""
        self._stand()
        self._stop_turning()


def _result(future: Future[Any]) -> Any:
    """Return the result of an action, None if another client's goal preempted it."""
    try:
        return future.result()
    except Cancelled:
        return None


def _same(a: SE2, b: SE2) -> bool:
    return a.distance(b) < REPLAN_DISTANCE and abs(wrap(a.yaw - b.yaw)) < REPLAN_ANGLE
