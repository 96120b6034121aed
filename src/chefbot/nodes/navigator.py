"""The navigator: plans, follows, replans periodically, and runs recovery behaviors."""

from __future__ import annotations

from collections.abc import Callable

from chefbot.behavior.navigation_progress import NavigationProgress, NavigationState
from chefbot.behavior.recovery import NavigatorParams, RecoverySequencer
from chefbot.behavior.relocalization import LOST
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.nodes.navigation.path_request import PathRequestNode
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.coroutines import Cancelled, Future, wait_any
from chefbot.runtime.node import In, Out, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed

PATIENCE_EXCEEDED, NO_VALID_CONTROL = 104, 106
"""Error codes of nav2_msgs/action/FollowPath: not localized in time; here also: the emergency stop is active."""


class NavigatorNode(PathRequestNode):
    """Serves navigate_to_pose; also accepts goals on the topic `goal_pose`, as RViz publishes them."""

    live_params = ("*",)  # from the next plan or recovery on
    params: NavigatorParams
    goal_pose: In[PoseStamped]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    navigate_to_pose = action_server(nav2.NavigateToPose)
    follow_path = action_client(nav2.FollowPath)
    navigate_to_pose_client = action_client(nav2.NavigateToPose, "navigate_to_pose")
    navigation_status: Out[NavigationStatus] = topic(latched=True)
    navigation_goal: Out[PoseStamped]

    def start(self) -> None:
        """Start idle, without a goal."""
        super().start()
        self._recovery = RecoverySequencer(forward_sensing_only=not self.robot.sensors.covers_rear)
        self._progress = NavigationProgress()
        self._publish_feedback: Callable[[], None] = lambda: None
        self._state = NavigationState()
        self._publish_status("idle", "")

    def on_goal_pose(self, goal: PoseStamped) -> None:
        """Navigate to a goal from the topic by calling the node's own action."""
        self.spawn(self._navigate_to_topic_goal(goal))

    async def _navigate_to_topic_goal(self, goal: PoseStamped) -> None:
        await self.navigate_to_pose_client.call(nav2.NavigateToPose_Goal(goal))

    def on_cancel(self, _: Empty) -> None:
        """Preempt the current goal of any client."""
        self.navigate_to_pose.preempt()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Preempt the goal on an emergency stop; nothing resumes by itself after the release."""
        if pressed.data:
            self.navigate_to_pose.preempt()
        elif (self._state.state, self._state.reason) == ("idle", REFUSED):
            self._publish_status("idle", "")  # goals are accepted again

    def _repeat_status(self) -> None:
        if self._state.is_active:
            self._publish_status(self._state.state, self._state.reason)

    def on_follow_path(self, feedback: nav2.FollowPath_Feedback) -> None:
        """Publish feedback from the controller's feedback, at a limited rate."""
        if self._progress.process(feedback, self.now_ns):
            self._publish_feedback()

    async def on_navigate_to_pose(
        self, goal: nav2.NavigateToPose_Goal, feedback: Callable[[nav2.NavigateToPose_Feedback], None]
    ) -> nav2.NavigateToPose_Result:
        """Navigate to the goal; after a failure run the next recovery behavior and try again."""
        if is_pressed(self.emergency_stop.last):
            return self._end(NO_VALID_CONTROL, REFUSED)
        self._recovery.restart()
        self._progress.restart(self.now_ns)
        self._publish_feedback = lambda: feedback(
            self._progress.feedback(self.now_ns, self._current_pose(), self._recovery.count)
        )
        self.navigation_goal.publish(goal.pose)
        try:
            while True:
                self._publish_feedback()
                code, sentence = await self._plan_and_follow(goal.pose)
                if not code or self._recovery.gives_up(code, self.params.recovery.rounds):
                    return self._end(code, sentence)
                behavior = self._recovery.next()
                self._publish_status("recovering", sentence)
                await self._recover(behavior, self.params.recovery)
        except Cancelled:
            self._publish_status("idle", "The goal was cancelled.")
            raise

    def _end(self, code: int, sentence: str) -> nav2.NavigateToPose_Result:
        """Publish the end of a goal and return its result; code 0 if it is reached."""
        sentence = sentence if code else ""
        self._publish_status("idle", sentence)
        return nav2.NavigateToPose_Result(code, sentence)

    async def _plan_and_follow(self, goal: PoseStamped) -> tuple[int, str]:
        """Plan and follow, replanning every `replan_period`, until the controller succeeds or fails.

        Returns the error code, 0 once the goal is reached, and the error message.
        """
        following: Future[nav2.FollowPath_Result] | None = None
        try:
            while True:
                # relocalize first if localization is lost
                if self._localization.is_lost:
                    if following is not None:
                        following.discard()
                    self._publish_status("recovering", LOST)
                    fault = await self._relocalize()
                    if fault:
                        return PATIENCE_EXCEEDED, fault
                # plan
                planned = await self._plan(goal)
                if planned.error_code != 0:
                    return planned.error_code, planned.error_msg
                self._publish_status("driving", "")
                # follow the path until it ends, the next plan is due or localization is lost
                following = self.follow_path.call(nav2.FollowPath_Goal(planned.path))
                self._localization_lost = Future()
                await wait_any(following, self.sleep(self.params.replan_period), self._localization_lost)
                if following.done:
                    return following.result().error_code, following.result().error_msg
        finally:
            if following is not None:
                following.discard()

    def _current_pose(self) -> PoseStamped:
        try:
            return PoseStamped(Header.of(self.now_ns, "map"), Pose.of(self.tf.lookup("map", "base_link")))
        except TransformError:
            return PoseStamped()  # not localized yet: the frame is empty

    def _publish_status(self, state: str, reason: str) -> None:
        self._state.state, self._state.reason = state, reason
        waiting_reason = self.standing.last.data if self.standing.last else ""
        status = self._state.message(self.now_ns, self._recovery.count, waiting_reason, self._limit)
        self.navigation_status.publish(status)
