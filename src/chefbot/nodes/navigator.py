"""The navigator: plans, follows, replans periodically, and runs recovery behaviors."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from chefbot.behavior.recovery import (
    BACK_UP_SPEED_FRACTION,
    RecoveryBehavior,
    RecoveryParams,
    recovery_sequence,
)
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus, NavigationStatus
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped
from chefbot.msgs.nav2_msgs import (
    BackUp,
    BackUp_Goal,
    ComputePathToPose,
    ComputePathToPose_Goal,
    FollowPath,
    FollowPath_Feedback,
    FollowPath_Goal,
    FollowPath_Result,
    NavigateToPose,
    NavigateToPose_Feedback,
    NavigateToPose_Goal,
    NavigateToPose_Result,
    Spin,
    Spin_Goal,
    Spin_Result,
)
from chefbot.msgs.std_msgs import Bool, Empty, Float64, Header, String
from chefbot.robot.motion_limits import max_speed
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.coroutines import Cancelled, Future, Task, wait_any
from chefbot.runtime.node import In, Node, Out, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed

PATIENCE_EXCEEDED = 104
"""Error code of nav2_msgs/action/FollowPath: timeout while waiting for a sensor or for localization."""
UNRECOVERABLE_ERRORS = (204, PATIENCE_EXCEEDED)
"""Error codes for which no recovery behavior is tried; 204: the goal is outside the map."""
REACHED = 0
ACTIVE_STATES = ("driving", "recovering")
"""States in which the controller is active."""
NO_VALID_CONTROL = 106
"""Error code of nav2_msgs/action/FollowPath; here: the emergency stop is active."""
FEEDBACK_PERIOD_NS = 500_000_000
"""Minimum time between two feedback messages, ns."""
MIN_SPEED_FOR_ETA = 0.01
"""Speed below which the estimated time remaining is reported as 0, m/s, as Nav2 does."""
COSTMAP_REFRESH_TIME = 1.0
"""Time that the sensors need to mark the present obstacles again, s."""
SPIN_STEP = math.pi / 4
"""Angle that a lost robot rotates between two checks of the localization, rad."""
MAX_SPIN_STEPS = 24
"""Number of rotation steps (three turns) after which a lost robot aborts the goal."""
LOCALIZED_UPDATES_REQUIRED = 3
"""Consecutive localized updates required, because two places can look alike for a moment."""
YIELD_TIME = 2.0
"""Time that a lost robot yields to another motion, as of the global localizer, before it rotates on, s."""
LOST = "Localization lost; rotating in place to relocalize."
NOT_FOUND = "Not localized after {} turns in place; set the initial pose in the web UI, or drive elsewhere."


class NavigatorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of replanning and of the recovery behaviors."""

    replan_period: Annotated[float, Meta(ge=0.2, le=60, description="replanning period while driving, s")] = (
        1.0
    )
    recovery: RecoveryParams = RecoveryParams()


class NavigatorNode(Node):
    """Serves navigate_to_pose; also accepts goals on the topic `goal_pose`, as RViz publishes them."""

    live_params = ("*",)  # from the next plan or recovery on
    params: NavigatorParams
    goal_pose: In[PoseStamped]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    localization_status: In[LocalizationStatus]
    standing: In[String] = topic("controller/standing")
    navigate_to_pose = action_server(NavigateToPose)
    compute_path_to_pose = action_client(ComputePathToPose)
    follow_path = action_client(FollowPath)
    spin = action_client(Spin)
    backup = action_client(BackUp)
    navigate_to_pose_client = action_client(NavigateToPose, "navigate_to_pose")
    clear_costmaps: Out[Float64]
    navigation_status: Out[NavigationStatus] = topic(latched=True)
    navigation_goal: Out[PoseStamped]

    def start(self) -> None:
        """Start idle, without a goal."""
        self._recovery_sequence = recovery_sequence(
            forward_sensing_only=self.robot.sensors.forward_sensing_only
        )
        self._recoveries = 0
        self._path_feedback = FollowPath_Feedback()
        self._feedback_ns = 0
        self._publish_feedback: Callable[[], None] = lambda: None
        self._topic_goal_task: Task[Any] | None = None
        self._state = ""
        self._localized_updates = 0
        self._localization_lost: Future[None] = Future()
        self._publish_status("idle", "")

    def on_goal_pose(self, goal: PoseStamped) -> None:
        """Navigate to a goal from the topic by calling the node's own action."""
        self._topic_goal_task = self.spawn(self._navigate_to_topic_goal(goal))

    async def _navigate_to_topic_goal(self, goal: PoseStamped) -> None:
        await self.navigate_to_pose_client.call(NavigateToPose_Goal(goal))

    def on_cancel(self, _: Empty) -> None:
        """Preempt the current goal of any client."""
        self.navigate_to_pose.preempt()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Preempt the goal on an emergency stop; nothing resumes by itself after the release."""
        if pressed.data:
            self.navigate_to_pose.preempt()
        elif (self._state, self._reason) == ("idle", REFUSED):
            self._publish_status("idle", "")  # goals are accepted again

    def on_localization_status(self, status: LocalizationStatus) -> None:
        """Count consecutive localized updates, and interrupt path following when localization is lost."""
        self._localized_updates = self._localized_updates + 1 if status.localized else 0
        if not status.localized:
            self._localization_lost.set_result(None)

    def on_standing(self, _: String) -> None:
        """Publish the status again when the controller starts or stops waiting."""
        if self._state in ACTIVE_STATES:
            self._publish_status(self._state, self._reason)

    def on_follow_path(self, feedback: FollowPath_Feedback) -> None:
        """Publish feedback from the controller's feedback, at a limited rate."""
        self._path_feedback = feedback
        if self.now_ns - self._feedback_ns >= FEEDBACK_PERIOD_NS:
            self._publish_feedback()

    async def on_navigate_to_pose(
        self, goal: NavigateToPose_Goal, feedback: Callable[[NavigateToPose_Feedback], None]
    ) -> NavigateToPose_Result:
        """Navigate to the goal; after a failure run the next recovery behavior and try again."""
        if is_pressed(self.emergency_stop.last):
            self._publish_status("idle", REFUSED)
            return NavigateToPose_Result(NO_VALID_CONTROL, REFUSED)
        self._recoveries, start_ns, self._path_feedback = 0, self.now_ns, FollowPath_Feedback()
        self._publish_feedback = lambda: feedback(self._feedback(start_ns))
        self.navigation_goal.publish(goal.pose)
        try:
            while True:
                self._publish_feedback()
                outcome = await self._plan_and_follow(goal.pose)
                if outcome.error_code == REACHED:
                    self._publish_status("idle", "")
                    return NavigateToPose_Result()
                if (
                    self._recoveries >= self.params.recovery.rounds * len(self._recovery_sequence)
                    or outcome.error_code in UNRECOVERABLE_ERRORS
                ):
                    self._publish_status("idle", outcome.error_msg)
                    return NavigateToPose_Result(outcome.error_code, outcome.error_msg)
                await self._recover(outcome.error_msg)
        except Cancelled:
            self._publish_status("idle", "The goal was cancelled.")
            raise

    async def _plan_and_follow(self, goal: PoseStamped) -> FollowPath_Result:
        """Plan and follow, replanning every `replan_period`, until the controller succeeds or fails."""
        following: Future[FollowPath_Result] | None = None
        try:
            while True:
                # relocalize first if localization is lost
                if self._is_lost:
                    if following is not None:
                        following.discard()
                    fault = await self._relocalize()
                    if fault:
                        return FollowPath_Result(error_code=PATIENCE_EXCEEDED, error_msg=fault)
                # plan
                planned = await self.compute_path_to_pose.call(ComputePathToPose_Goal(goal))
                if planned.error_code != 0:
                    return FollowPath_Result(error_code=planned.error_code, error_msg=planned.error_msg)
                self._publish_status("driving", "")
                # follow the path until it ends, the next plan is due or localization is lost
                following = self.follow_path.call(FollowPath_Goal(planned.path))
                self._localization_lost = Future()
                await wait_any(following, self.sleep(self.params.replan_period), self._localization_lost)
                if following.done:
                    return following.result()
        finally:
            if following is not None:
                following.discard()

    @property
    def _is_lost(self) -> bool:
        """Whether localization reports that it is lost; False without localization, as while mapping."""
        status = self.localization_status.last
        return status is not None and not status.localized

    async def _relocalize(self) -> str:
        """Rotate in place, which cannot collide, until localization has converged for some updates.

        Returns an error message, empty on success.
        """
        self._publish_status("recovering", LOST)
        for _ in range(MAX_SPIN_STEPS):
            result = await self._spin_one_step()
            if self._localized_updates >= LOCALIZED_UPDATES_REQUIRED:
                return ""
            if result is None:
                await self.sleep(YIELD_TIME)
            elif result.error_code:
                return result.error_msg
        return NOT_FOUND.format(round(MAX_SPIN_STEPS * SPIN_STEP / (2.0 * math.pi)))

    async def _spin_one_step(self) -> Spin_Result | None:
        """Rotate by one step; return None if another motion preempted this one."""
        spinning = self.spin.call(Spin_Goal(SPIN_STEP, Duration.of(15.0)))
        await wait_any(spinning)
        try:
            return spinning.result()
        except Cancelled:
            return None

    async def _recover(self, reason: str) -> None:
        """Run the next recovery behavior of the sequence."""
        recovery = self._recovery_sequence[self._recoveries % len(self._recovery_sequence)]
        self._recoveries += 1
        self._publish_status("recovering", reason)
        await self._run_recovery(recovery)

    async def _run_recovery(self, recovery: RecoveryBehavior) -> None:
        params = self.params.recovery
        if recovery is RecoveryBehavior.CLEAR:
            self.clear_costmaps.publish(Float64(params.clear_radius))
            await self.sleep(COSTMAP_REFRESH_TIME)
        elif recovery is RecoveryBehavior.SPIN:
            await self.spin.call(Spin_Goal(params.spin, Duration.of(30.0)))
        elif recovery is RecoveryBehavior.BACK_UP:
            speed = BACK_UP_SPEED_FRACTION * max_speed(self.robot)
            await self.backup.call(BackUp_Goal(Point(-params.back_up), speed, Duration.of(10.0)))
        else:
            await self.sleep(params.wait)

    def _feedback(self, start_ns: int) -> NavigateToPose_Feedback:
        self._feedback_ns = self.now_ns
        elapsed = Duration.of((self.now_ns - start_ns) / 1e9)
        distance_remaining, speed = self._path_feedback.distance_to_goal, self._path_feedback.speed
        time_remaining = Duration.of(distance_remaining / speed) if speed > MIN_SPEED_FOR_ETA else Duration()
        return NavigateToPose_Feedback(
            self._current_pose(), elapsed, time_remaining, self._recoveries, distance_remaining
        )

    def _current_pose(self) -> PoseStamped:
        try:
            return PoseStamped(Header.of(self.now_ns, "map"), Pose.of(self.tf.lookup("map", "base_link")))
        except TransformError:
            return PoseStamped()  # not localized yet: the frame is empty

    def _publish_status(self, state: str, reason: str) -> None:
        """Publish state and reason; while the controller waits, the state is `waiting` with its reason."""
        self._state, self._reason = state, reason
        waiting_reason = self.standing.last.data if self.standing.last and state in ACTIVE_STATES else ""
        header = Header.of(self.now_ns, "map")
        status = ("waiting", waiting_reason) if waiting_reason else (state, reason)
        self.navigation_status.publish(NavigationStatus(header, status[0], self._recoveries, status[1]))
