"""Path following: local replanning, one cycle of the controller, and the judgement of progress."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.control.controller import ComparedTwists, ComparesTwists, Controller, ControllerStatus
from chefbot.control.final_approach import FinalApproach
from chefbot.control.goal_checkers import GoalParams, ProgressChecker
from chefbot.control.people_cost import NOBODY, NearbyPeople
from chefbot.control.trajectory import predicted_trajectory
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.nav2_msgs import FollowPath_Result
from chefbot.robot.motion_limits import Limits

BLOCKED_TIMEOUT = 3.0
"""Time without an admissible command before the path counts as blocked, s: people pass by."""

Replan = Callable[[NDArray[np.float64], SE2, Costmap], NDArray[np.float64]]
"""Returns the path (n, 3) itself if it is free from the pose on, else one with a detour, all in one frame."""


class FollowPathError(IntEnum):
    """Reasons for which following a path fails, as the error codes of nav2_msgs/action/FollowPath."""

    NO_TRANSFORM = 102
    INVALID_PATH = 103
    PATIENCE_EXCEEDED = 104
    STUCK = 105
    NO_VALID_CONTROL = 106


class PathStep(NamedTuple):
    """One cycle: the twist to command (m/s, rad/s) and, once following has ended, its result.

    speed: the forward speed that the controller chose, m/s, also while the sensors forbid driving forward. status:
    the state of the controller.
    """

    v: float
    w: float
    speed: float
    result: FollowPath_Result | None
    status: ControllerStatus


class PathFollower:
    """Follows a path until its end is reached, or until the robot is blocked or stuck.

    controller: computes the twists. replan: leads the path around obstacles in the local costmap. period: time
    between two cycles, s. final: takes over near a goal with tolerances of its own. Paths, poses and costmaps are in
    one frame that does not jump.
    """

    def __init__(
        self, controller: Controller, replan: Replan, period: float, final: FinalApproach | None = None
    ) -> None:
        self._controller, self._replan, self._period, self._final = controller, replan, period, final
        self._progress = ProgressChecker()
        self._goal = IDENTITY
        self.frame = IDENTITY
        """Pose of the path's frame in the costmap's; near a goal with tolerances the newest one is used."""
        self.given_path = np.zeros((0, 3))
        """The path (n, 3) as it was given."""
        self.path = self.given_path
        """The path (n, 3) that is followed, with the detours of local replanning."""
        self._blocked_time = 0.0
        self._prediction: Callable[[Limits, float], NDArray[np.float64]] | None = None

    def replace_controller(self, controller: Controller) -> None:
        """Use another controller from the next cycle on, for the current path as well."""
        self._controller = controller
        if len(self.path):
            controller.set_path(self.path, same_goal=False)

    def set_path(
        self,
        path: NDArray[np.float64],
        frame: SE2,
        *,
        following: bool,
        tolerance: GoalParams | None = None,
    ) -> bool:
        """Set the path (n, 3), n >= 1, in a frame whose pose in the costmap's frame is `frame`.

        following: whether the previous path has not ended yet; a path to the same goal then replaces it, and the
        checks for progress go on. tolerance: of this goal, if it has its own. Returns whether the goal is a new one.
        """
        goal = SE2.of(path[-1])
        same_goal = following and goal == self._goal
        self._goal, self.frame = goal, frame
        if not same_goal and self._final is not None:
            self._final.reset(tolerance)
        if not same_goal:
            self._progress.reset()
            self._blocked_time, self._prediction = 0.0, None
        self.given_path = np.column_stack([frame.apply(path[:, :2]), path[:, 2] + frame.yaw])
        self._track(self.given_path, same_goal=same_goal)
        return not same_goal

    def pause(self) -> None:
        """Restart the check for progress: the robot stands still on purpose."""
        self._progress.reset()
        self._prediction = None

    def trajectory(self, limits: Limits, duration: float) -> NDArray[np.float64] | None:
        """Return the trajectory (n, 3) that the latest cycle chose, for `duration` seconds but not beyond the goal.

        None before the first cycle and while the robot stands still on purpose.
        """
        return self._prediction(limits, duration) if self._prediction is not None else None

    def candidates(self) -> ComparedTwists | None:
        """Return what the latest cycle chose from; None if the controller has compared nothing."""
        controller = self._controller
        if self._prediction is None or not isinstance(controller, ComparesTwists):
            return None
        return controller.candidates

    def step(
        self,
        pose: SE2,
        twist: tuple[float, float],
        costmap: Costmap,
        blind: str,
        people: NearbyPeople = NOBODY,
    ) -> PathStep:
        """Run one cycle from the current pose and the present twist (v, w).

        blind: why the robot must not drive forward now, or an empty string. people: those around, in the same frame.
        """
        # replan locally around obstacles that are not on the map
        path = self._replan(self.given_path, pose, costmap)
        if path is not self.path:
            self._track(path, same_goal=True)
        # one cycle of the controller
        goal = self.frame @ self._goal
        if self._final is not None and self._final.is_active(pose, goal, costmap):
            v, w, status = self._final.command(pose, twist, goal, costmap)
        else:
            v, w, status = self._controller.command(pose, twist, costmap, people)
            if status is ControllerStatus.REACHED and self._final is not None and self._final.is_wanted:
                status = ControllerStatus.BLOCKED
        blind = blind if v > 0.0 else ""
        result = self._judge(pose, status, blind)
        step = PathStep(0.0 if blind else v, w, v, result, status)
        self._prediction = partial(
            predicted_trajectory, pose, twist, (step.v, w), max_distance=pose.distance(SE2.of(path[-1]))
        )
        return step

    @property
    def is_blocked(self) -> bool:
        """Whether the last cycle had no command, though the end is not reached."""
        return self._blocked_time > 0.0

    def _track(self, path: NDArray[np.float64], *, same_goal: bool) -> None:
        self.path = path
        self._controller.set_path(path, same_goal=same_goal)

    def _judge(self, pose: SE2, status: ControllerStatus, blind: str) -> FollowPath_Result | None:
        """Return the result if the end is reached or the robot is blocked or stuck, else None."""
        blocked = bool(blind) or status is ControllerStatus.BLOCKED
        self._blocked_time = self._blocked_time + self._period if blocked else 0.0
        progressing = self._progress.is_progressing(pose, self._period)
        if status is ControllerStatus.REACHED:
            return FollowPath_Result()
        if self._blocked_time >= BLOCKED_TIMEOUT:
            return failed_path(FollowPathError.NO_VALID_CONTROL, blind or "No collision-free command.")
        return None if progressing else failed_path(FollowPathError.STUCK, "No progress: the robot is stuck.")


def failed_path(error: FollowPathError, sentence: str) -> FollowPath_Result:
    """Return the result of a path that was not followed to its end."""
    return FollowPath_Result(error_code=int(error), error_msg=sentence)
