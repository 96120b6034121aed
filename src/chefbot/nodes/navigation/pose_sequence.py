"""Drives through poses without stopping at those before the last one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.behavior.waypoints import PosesToPass
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.std_msgs import Empty
from chefbot.nodes.navigation.goal_pose import GoalError, goal_in_map
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.coroutines import Future, wait_any
from chefbot.runtime.node import In, Node, every
from chefbot.runtime.transform_buffer import TransformError

CHECK_RATE = 10.0
"""Rate at which the distance to the next pose is checked, Hz."""
UNKNOWN = 9100
"""Error code of nav2_msgs/action/NavigateThroughPoses; those of planning and following are passed on."""


class PoseSequenceParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of driving through poses."""

    radius: Annotated[
        float,
        Meta(ge=0.1, le=5.0, description="distance at which a pose before the last counts as passed, m"),
    ] = 0.5


class PoseSequenceNode(Node):
    """Serves navigate_through_poses by navigate_to_pose: near a pose it sends the next one."""

    live_params = ("*",)
    params: PoseSequenceParams
    cancel: In[Empty]
    navigate_through_poses = action_server(nav2.NavigateThroughPoses)
    navigate_to_pose = action_client(nav2.NavigateToPose)

    def start(self) -> None:
        """Start without poses to drive through."""
        self._run: PosesToPass | None = None
        self._last = nav2.NavigateToPose_Feedback()
        self._passed: Future[None] = Future()
        self._recoveries, self._start_ns = 0, 0
        self._publish: Callable[[nav2.NavigateThroughPoses_Feedback], None] = lambda _: None

    def on_cancel(self, _: Empty) -> None:
        """End the run of any client."""
        self.navigate_through_poses.preempt()

    def on_navigate_to_pose(self, feedback: nav2.NavigateToPose_Feedback) -> None:
        """Keep the feedback of the present pose and publish that of all."""
        self._last = feedback
        if self._run is not None:
            self._publish(self._feedback(self._run))

    @every(hz=CHECK_RATE)
    def check_passing(self) -> None:
        """Advance to the next pose once the robot is near the present one."""
        if self._run is None or not self._last.current_pose.header.frame_id:
            return
        try:
            robot = self.tf.lookup("map", "base_link")
        except TransformError:
            return  # not localized: the navigator relocalizes
        if self._run.passes(robot, self._last.distance_remaining):
            self._passed.set_result(None)

    async def on_navigate_through_poses(
        self,
        goal: nav2.NavigateThroughPoses_Goal,
        feedback: Callable[[nav2.NavigateThroughPoses_Feedback], None],
    ) -> nav2.NavigateThroughPoses_Result:
        """Drive through the poses; one that cannot be reached ends the action."""
        if not goal.poses.goals:
            return nav2.NavigateThroughPoses_Result(UNKNOWN, "The list of poses is empty.")
        try:
            poses = [goal_in_map(pose, self.tf) for pose in goal.poses.goals]
        except GoalError as error:
            return nav2.NavigateThroughPoses_Result(error.code, str(error))
        self._run = run = PosesToPass(poses, self.params.radius)
        self._publish, self._start_ns, self._recoveries = feedback, self.now_ns, 0
        try:
            return await self._drive(run)
        finally:
            if self._run is run:
                self._run = None

    async def _drive(self, run: PosesToPass) -> nav2.NavigateThroughPoses_Result:
        while True:
            self._last, self._passed = nav2.NavigateToPose_Feedback(), Future()
            driving = self.navigate_to_pose.call(nav2.NavigateToPose_Goal(run.pose))
            await wait_any(driving, self._passed)
            if driving.done:
                result = driving.result()
                code, text = result.error_code, result.error_msg
                return nav2.NavigateThroughPoses_Result(code, text, run.statuses(code, text, ended=True))
            self._recoveries += self._last.number_of_recoveries

    def _feedback(self, run: PosesToPass) -> nav2.NavigateThroughPoses_Feedback:
        """Return the feedback on all poses: the path to the next one, and straight lines from there on."""
        now, after = self._last, run.distance_after()
        to_next = now.distance_remaining
        time = now.estimated_time_remaining.seconds
        whole = time * (to_next + after) / to_next if to_next > 0.0 else 0.0
        elapsed = (self.now_ns - self._start_ns) / 1e9
        return nav2.NavigateThroughPoses_Feedback(
            now.current_pose,
            Duration.of(elapsed),
            Duration.of(whole),
            self._recoveries + now.number_of_recoveries,
            to_next + after,
            run.remaining,
            run.statuses(ended=False),
        )
