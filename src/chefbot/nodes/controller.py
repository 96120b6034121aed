"""The controller server: path following, and the motions of the behavior server, on one local costmap."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from chefbot.control.controller import Controller
from chefbot.control.controller_params import CONTROL_PERIOD, CONTROL_RATE, LIVE_PARAMS
from chefbot.control.final_approach import FinalApproach
from chefbot.control.localization_watch import LocalizationWatch
from chefbot.control.path_follower import FollowPathError, PathFollower, failed_path
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav2_msgs import FollowPath, FollowPath_Feedback, FollowPath_Goal, FollowPath_Result
from chefbot.nodes.behavior_server import BehaviorServerNode
from chefbot.nodes.local_costmap import LocalCostmapNode
from chefbot.nodes.navigation.contacts import ContactsNode
from chefbot.nodes.navigation.controller_params import ControllerNodeParams
from chefbot.nodes.navigation.goal_tolerances import GoalTolerancesNode
from chefbot.nodes.navigation.local_plan import LocalPlanNode
from chefbot.nodes.navigation.narrow_passages import NarrowPassagesNode
from chefbot.nodes.navigation.side_looking import SideLookingNode
from chefbot.planning.local_replanning import local_planner, remaining_length, replan_locally
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.actions import action_server
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, every
from chefbot.runtime.plugins import load_plugin
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed


class ControllerNode(
    BehaviorServerNode, ContactsNode, GoalTolerancesNode, LocalPlanNode, NarrowPassagesNode, SideLookingNode
):
    """Serves follow_path and three motions in the frame `odom`.

    It commands a twist only while every obstacle sensor of the robot file sends valid data, and follows a path only
    while localization, if there is one, has converged and sends its pose. Otherwise, and below a speed limit too low
    to drive, it stands still, publishes the reason on `controller/wait_reason` (else empty), and resumes by itself.
    """

    live_params = (*LocalCostmapNode.live_params, *LIVE_PARAMS)
    params: ControllerNodeParams
    localization_status: In[LocalizationStatus]
    follow_path = action_server(FollowPath)

    def start(self) -> None:
        """Create the local costmap, the controller and the sensor monitors."""
        super().start()
        replan = partial(replan_locally, planner=local_planner())
        final = FinalApproach(Limits.of(self.robot), CONTROL_PERIOD)
        self._follower = PathFollower(self._make_controller(), replan, CONTROL_PERIOD, final)
        self._localization = LocalizationWatch()
        self._following: Future[FollowPath_Result] | None = None
        self._feedback: Callable[[FollowPath_Feedback], None] = lambda _: None

    def reconfigure(self, params: ControllerNodeParams) -> None:
        """Apply new parameters from the next command on, for the current path as well."""
        super().reconfigure(params)
        self._follower.replace_controller(self._make_controller())

    def _make_controller(self) -> Controller:
        make_dwa = partial(self.params.make_dwa, self.robot)
        return load_plugin(self.params.plugin, make_dwa, self.params.settings, Controller)

    @property
    def is_active(self) -> bool:
        """Whether a path or a motion is active."""
        return self._motion is not None or self._following is not None

    async def on_follow_path(
        self, goal: FollowPath_Goal, feedback: Callable[[FollowPath_Feedback], None]
    ) -> FollowPath_Result:
        """Follow the path until its end is reached, or fail if the robot is blocked or stuck."""
        if is_pressed(self.emergency_stop.last):
            return failed_path(FollowPathError.NO_VALID_CONTROL, REFUSED)
        if not goal.path.poses:
            return failed_path(FollowPathError.INVALID_PATH, "The path has no poses.")
        try:
            odom_T_path = self.tf.lookup("odom", goal.path.header.frame_id)
        except TransformError as error:
            return failed_path(FollowPathError.NO_TRANSFORM, f"The path cannot be placed: {error}")
        following = self._following is not None and not self._following.done
        path, tolerance = goal.path.array, self._tolerance_of(goal.path)
        if self._follower.set_path(path, odom_T_path, following=following, tolerance=tolerance):
            self._waiting.resume()
            self._publish_waiting()
        self._feedback, self._following = feedback, Future()
        try:
            return await self._following
        except Cancelled:
            if not self.follow_path.preempting:
                self._stop()
            raise

    @every(hz=CONTROL_RATE)
    def control(self) -> None:
        """Publish one command while a path or a motion is active."""
        pose = self._pose()
        if not self.is_active or pose is None:
            return  # no goal, or no odometry yet
        costs = self._costs_around(pose)
        odom_ns, status = self.tf.newest_ns("odom"), self.localization_status.last
        lost = self._localization.reason(status, pose, odom_ns, self.now_ns)
        reason = self._sensor_fault(pose, costs) or self._too_slow or (lost if self._motion is None else "")
        if reason:
            self._follower.pause()
            self._stop_looking()
            sentence = self._wait(reason, CONTROL_PERIOD)
            if sentence and self._following is not None:
                self._finish_path(self._following, failed_path(FollowPathError.PATIENCE_EXCEEDED, sentence))
        elif self._motion is not None:
            self._step_motion(pose, costs, self._blind_ahead(pose, costs), CONTROL_PERIOD)
        elif self._following is not None:
            self._step_path(self._following, pose, costs)

    def _step_path(self, following: Future[FollowPath_Result], pose: SE2, costs: Costmap) -> None:
        self._place_goal(self._follower)
        present, people = self.cmd_vel.last or Twist(), self._nearby_people()
        costs = self._passage_costs(self._follower, pose, costs, people)
        blind = self._blind_ahead(pose, costs) or self._hidden
        twist = present.linear.x, present.angular.z
        step = self._creep(self._follower.step(pose, twist, costs, blind, people))
        step = self._ended_by_slip(self._look_aside(step, pose, costs, people))
        self.report_step(step, self._follower, pose, costs, blind)
        self._drive(step.v, step.w)
        self._feedback(FollowPath_Feedback(remaining_length(self._follower.path, pose), step.speed))
        if step.result is not None:
            self._finish_path(following, step.result)

    def _finish_path(self, following: Future[FollowPath_Result], result: FollowPath_Result) -> None:
        if result.error_code and self._limit not in result.error_msg:
            result = failed_path(FollowPathError(result.error_code), f"{result.error_msg} {self._limit}")
        self._stop()
        if result.error_code == FollowPathError.STUCK:
            self.publish_contact_if_driven()
        following.set_result(result)

    def _stop(self) -> None:
        self._following = None
        self._stop_looking()
        super()._stop()

    def _preempt_path(self) -> None:
        self.follow_path.preempt()
