"""The controller server: path following, and the motions of the behavior server, on one local costmap."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated

import numpy as np
from msgspec import Meta

from chefbot.control.controller import Controller
from chefbot.control.dwa import DwaController
from chefbot.control.dwa_params import DwaParams
from chefbot.control.goal_checkers import GoalParams
from chefbot.control.path_follower import (
    INVALID_PATH,
    NO_TRANSFORM,
    NO_VALID_CONTROL,
    PATIENCE_EXCEEDED,
    PathFollower,
    failed_path,
)
from chefbot.control.waiting_state import LOST, WaitTimeoutError
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav2_msgs import FollowPath, FollowPath_Feedback, FollowPath_Goal, FollowPath_Result
from chefbot.msgs.std_msgs import Bool
from chefbot.nodes.behavior_server import BehaviorServerNode
from chefbot.nodes.local_costmap import LocalCostmapNode, LocalCostmapParams
from chefbot.planning.local_replanning import local_planner, remaining_length, replan_locally
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.actions import action_server
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, every
from chefbot.runtime.plugins import load_plugin
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed

RATE = 10.0


class ControllerNodeParams(LocalCostmapParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the local costmap and of the controller plugin."""

    plugin: str = ""
    """`pkg.module:Class` of a custom controller; its constructor receives `settings`."""
    settings: DwaParams = DwaParams(period=1.0 / RATE)
    goal: GoalParams = GoalParams()
    speed: Annotated[
        float,
        Meta(ge=0.1, le=1.0, description="fraction of the maximum speed that the built-in controller uses"),
    ] = 1.0


class ControllerNode(BehaviorServerNode):
    """Serves follow_path and three motions in the frame `odom`.

    It commands a twist only while every obstacle sensor of the robot file sends valid data, and follows a path only
    while localization, if there is one, has converged. Otherwise it stands still, publishes the reason on `standing`
    (empty while it does not wait), and resumes by itself.
    """

    live_params = (
        *LocalCostmapNode.live_params,
        *("settings.sim_time", "settings.*_samples", "settings.*_weight", "settings.slowing"),
        *("settings.rotate_from", "goal.*", "speed"),
    )
    params: ControllerNodeParams
    cmd_vel: In[Twist]
    localization_status: In[LocalizationStatus]
    follow_path = action_server(FollowPath)

    def start(self) -> None:
        """Create the local costmap, the controller and the sensor monitors."""
        super().start()
        replan = partial(replan_locally, planner=local_planner())
        self._follower = PathFollower(self._make_controller(), replan, 1.0 / RATE)
        self._following: Future[FollowPath_Result] | None = None
        self._feedback: Callable[[FollowPath_Feedback], None] = lambda _: None

    def reconfigure(self, params: ControllerNodeParams) -> None:
        """Apply new parameters from the next command on, for the current path as well."""
        super().reconfigure(params)
        self._follower.replace_controller(self._make_controller())

    def _make_controller(self) -> Controller:
        controller: Controller = load_plugin(self.params.plugin, self._make_dwa, self.params.settings)
        return controller

    def _make_dwa(self, settings: DwaParams) -> DwaController:
        limits = Limits.of(self.robot)
        limits = limits._replace(speed=limits.speed * self.params.speed)
        return DwaController(limits, settings, self.params.goal)

    @property
    def is_active(self) -> bool:
        """Whether a path or a motion is active."""
        return self._motion is not None or self._following is not None

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Preempt all goals on an emergency stop; clients must send them again after the release."""
        if pressed.data:
            self.follow_path.preempt()
        super().on_emergency_stop(pressed)

    async def on_follow_path(
        self, goal: FollowPath_Goal, feedback: Callable[[FollowPath_Feedback], None]
    ) -> FollowPath_Result:
        """Follow the path until its end is reached, or fail if the robot is blocked or stuck."""
        if is_pressed(self.emergency_stop.last):
            return failed_path(NO_VALID_CONTROL, REFUSED)
        path = np.array([pose.pose.se2 for pose in goal.path.poses]).reshape(-1, 3)
        if len(path) == 0:
            return failed_path(INVALID_PATH, "The path has no poses.")
        try:
            odom_T_path = self.tf.lookup("odom", goal.path.header.frame_id)
        except TransformError as error:
            return failed_path(NO_TRANSFORM, f"The path cannot be placed: {error}")
        following = self._following is not None and not self._following.done
        if self._follower.set_path(path, odom_T_path, following=following):
            self._waiting.resume()
            self._publish_waiting()
        self._feedback, self._following = feedback, Future()
        try:
            return await self._following
        except Cancelled:
            if not self.follow_path.preempting:
                self._stop()
            raise

    @every(hz=RATE)
    def control(self) -> None:
        """Publish one command while a path or a motion is active."""
        pose = self._pose()
        if not self.is_active or pose is None:
            return  # no goal, or no odometry yet: the base stands still
        costs = self._costs_around(pose)
        reason = self._sensors.fault(self.now_ns, pose) or self._lost_reason()
        if reason:
            self._wait(reason)
        elif self._motion is not None:
            self._step_motion(pose, costs, self._sensors.blind_ahead(pose, costs), 1.0 / RATE)
        elif self._following is not None:
            self._step_path(self._following, pose, costs)

    def _lost_reason(self) -> str:
        status = self.localization_status.last
        return LOST if self._motion is None and status is not None and not status.localized else ""

    def _wait(self, reason: str) -> None:
        """Stand still for a cycle; the goal fails once the timeout has passed."""
        self.cmd_vel_nav.publish(Twist())
        self._follower.pause()
        sentence = self._waiting.wait(reason, 1.0 / RATE)
        self._publish_waiting()
        if sentence and self._motion_ended is not None:
            self._motion_ended.set_exception(WaitTimeoutError(sentence))
        elif sentence and self._following is not None:
            self._finish_path(self._following, failed_path(PATIENCE_EXCEEDED, sentence))

    def _step_path(self, following: Future[FollowPath_Result], pose: SE2, costs: Costmap) -> None:
        present = self.cmd_vel.last or Twist()
        blind = self._sensors.blind_ahead(pose, costs)
        step = self._follower.step(pose, (present.linear.x, present.angular.z), costs, blind)
        self._drive(step.v, step.w)
        if step.result is not None:
            self._finish_path(following, step.result)
        else:
            self._feedback(FollowPath_Feedback(remaining_length(self._follower.path, pose), step.speed))

    def _finish_path(self, following: Future[FollowPath_Result], result: FollowPath_Result) -> None:
        self._stop()
        following.set_result(result)

    def _stop(self) -> None:
        self._following = None
        super()._stop()

    def _preempt_path(self) -> None:
        self.follow_path.preempt()
