"""The navigator: runs the behavior tree of a goal, which plans, follows, replans and recovers."""

from __future__ import annotations

from collections.abc import Callable

from chefbot.behavior.navigation_progress import NavigationProgress, NavigationState
from chefbot.behavior.recovery import NavigatorParams
from chefbot.behavior_tree.blackboard import BehaviorTreeError
from chefbot.behavior_tree.navigation_tree import NavigationTrees
from chefbot.causes.statuses import CANCELLED, ENDED_BY_STOP
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.nodes.navigation.goal_pose import GoalError, goal_in_map
from chefbot.nodes.navigation.tree_runner import TreeRunnerNode
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.coroutines import Cancelled
from chefbot.runtime.node import In, Out, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed

NO_VALID_CONTROL, UNKNOWN = 106, 100
"""Error codes of nav2_msgs/action/FollowPath; here: the emergency stop is active; the tree itself failed."""
NO_ERROR = "The behavior tree failed without an error of an action."


class NavigatorNode(TreeRunnerNode):
    """Serves navigate_to_pose; also accepts goals on the topic `goal_pose`, as RViz publishes them."""

    live_params = ("replan_period", "recovery.*", "waiting.*")  # from the next plan or recovery on
    params: NavigatorParams
    goal_pose: In[PoseStamped]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    navigate_to_pose = action_server(nav2.NavigateToPose)
    navigate_to_pose_client = action_client(nav2.NavigateToPose, "navigate_to_pose")
    navigation_status: Out[NavigationStatus] = topic(latched=True)
    navigation_goal: Out[PoseStamped]

    def start(self) -> None:
        """Start idle, without a goal."""
        super().start()
        self._trees = NavigationTrees(self.services, self.robot, self.params.behavior_tree)
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

    def _begin_recovery(self) -> None:
        super()._begin_recovery()
        self._publish_feedback()  # without a path the controller gives none

    def on_follow_path(self, feedback: nav2.FollowPath_Feedback) -> None:
        """Publish feedback from the controller's feedback, at a limited rate."""
        if self._progress.process(feedback, self.now_ns):
            self._publish_feedback()

    async def on_navigate_to_pose(
        self, goal: nav2.NavigateToPose_Goal, feedback: Callable[[nav2.NavigateToPose_Feedback], None]
    ) -> nav2.NavigateToPose_Result:
        """Run the behavior tree until the goal is reached, or the tree has failed."""
        if is_pressed(self.emergency_stop.last):
            return self._end(NO_VALID_CONTROL, REFUSED)
        self._restart_services()
        self._publish_status("driving", "")
        try:
            pose = goal_in_map(goal.pose, self.tf)
        except GoalError as error:
            return self._end(error.code, str(error))
        self._progress.restart(self.now_ns)
        self._publish_feedback = lambda: feedback(
            self._progress.feedback(self.now_ns, self._current_pose(), self._recoveries)
        )
        self.navigation_goal.publish(pose)
        self._publish_feedback()
        tree = self._trees.new_tree(pose)
        try:
            reached = await self._run(tree, lambda: self._trees.set_params(tree, self.params))
        except Cancelled:
            if not self.navigate_to_pose.preempting:
                stopped = is_pressed(self.emergency_stop.last)
                self._publish_status("idle", ENDED_BY_STOP if stopped else CANCELLED)
            raise
        except BehaviorTreeError as error:
            return self._end(UNKNOWN, f"The behavior tree failed: {error}")
        finally:
            tree.halt()
        if reached:
            return self._end(0, "")
        return self._end(*(self._failure if self._failure[0] else (UNKNOWN, NO_ERROR)))

    def _end(self, code: int, sentence: str) -> nav2.NavigateToPose_Result:
        """Publish the end of a goal and return its result; code 0 if it is reached, or a free pose near it."""
        self._publish_status("idle", sentence if code else "")
        return nav2.NavigateToPose_Result(code, sentence if code else self._goal_notice)

    def _current_pose(self) -> PoseStamped:
        try:
            return PoseStamped(Header.of(self.now_ns, "map"), Pose.of(self.tf.lookup("map", "base_link")))
        except TransformError:
            return PoseStamped()  # not localized yet: the frame is empty

    def _publish_status(self, state: str, reason: str) -> None:
        self._state.state, self._state.reason = state, reason
        waiting_reason = self.wait_reason.last.data if self.wait_reason.last else ""
        status = self._state.message(self.now_ns, self._recoveries, waiting_reason, self._limit)
        self.navigation_status.publish(status)
