"""Follows a person who is tracked, by action or on request of the web UI."""

from __future__ import annotations

from collections.abc import Callable

from chefbot.maths.se2 import SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import FollowOrder, NavigationStatus
from chefbot.msgs.chefbot_msgs.people import TrackedPeople
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.std_msgs import Bool, Empty
from chefbot.nodes.navigation.mission_node import MissionNode
from chefbot.nodes.navigation.target_driver import FRAME, TargetDriverNode
from chefbot.people.following import (
    FAILED_TO_CONTROL,
    GOAL_REJECTED,
    TF_ERROR,
    FollowingParams,
    FollowStep,
    PersonFollower,
    followed_person,
)
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.coroutines import Cancelled
from chefbot.runtime.node import In
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed

PERIOD = 0.2
"""Time between two decisions, s."""
NOT_A_PERSON = "This robot follows tracked people: person_7 is number 7, person the nearest one ahead."
ENDED_BY_STOP = "The emergency stop ended the following."
BUSY = "The robot is driving to a goal; cancel it first."


class FollowingServerNode(MissionNode, TargetDriverNode):
    """Serves follow_object for people, in frames named `person_<number>`; `follow_order` comes from the web UI.

    A goal of the navigator ends the following.
    """

    live_params = ("*",)
    params: FollowingParams
    tracked_people: In[TrackedPeople]
    follow_order: In[FollowOrder]
    navigation_goal: In[PoseStamped]
    navigation_status: In[NavigationStatus]
    emergency_stop: In[Bool]
    cancel: In[Empty]
    follow_object = action_server(nav2.FollowObject)
    follow_object_client = action_client(nav2.FollowObject, "follow_object")

    def on_follow_order(self, order: FollowOrder) -> None:
        """Follow a person by the node's own action."""
        self.spawn(self._follow(order.person))

    async def _follow(self, number: int) -> None:
        frame = f"person_{number}" if number else "person"
        await self.follow_object_client.call(nav2.FollowObject_Goal(tracked_frame=frame))

    def on_cancel(self, _: Empty) -> None:
        """End the following of any client."""
        self.follow_object.preempt()

    def on_navigation_goal(self, _: PoseStamped) -> None:
        """End the following: a goal drives the robot elsewhere."""
        self.follow_object.preempt()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """End the following on an emergency stop; nothing resumes by itself after the release."""
        if pressed.data:
            self.follow_object.preempt()

    async def on_follow_object(
        self, goal: nav2.FollowObject_Goal, feedback: Callable[[nav2.FollowObject_Feedback], None]
    ) -> nav2.FollowObject_Result:
        """Follow a person until it is lost, the time is over, or the goal is cancelled."""
        number = followed_person(goal.tracked_frame)
        if goal.pose_topic or number is None:
            return self._end(nav2.FollowObject_Result(error_code=GOAL_REJECTED, error_msg=NOT_A_PERSON))
        status = self.navigation_status.last
        refusal = REFUSED if is_pressed(self.emergency_stop.last) else ""
        refusal = refusal or (BUSY if status is not None and status.state != "idle" else "")
        if refusal:
            return self._end(nav2.FollowObject_Result(error_code=GOAL_REJECTED, error_msg=refusal))
        self._begin()
        try:
            return self._end(await self._run(number, goal.max_duration.seconds, feedback))
        except Cancelled:
            stopped = is_pressed(self.emergency_stop.last)
            self._publish_outcome(ENDED_BY_STOP if stopped else "Following was cancelled.")
            raise
        finally:
            self._halt()

    async def _run(
        self, number: int, max_duration: float, feedback: Callable[[nav2.FollowObject_Feedback], None]
    ) -> nav2.FollowObject_Result:
        start_ns = self.now_ns
        follower = PersonFollower(self.params, number, start_ns / 1e9)
        while True:
            elapsed = (self.now_ns - start_ns) / 1e9
            follower.params = self.params
            step = self._step(follower)
            self._publish_phase(step.sentence)
            time = Duration.of(elapsed)
            feedback(nav2.FollowObject_Feedback(step.state, time, follower.retries))
            if step.error_code or (max_duration and elapsed >= max_duration):
                text = step.sentence if step.error_code else ""
                return nav2.FollowObject_Result(time, step.error_code, follower.retries, text)
            self._act(step)
            await self.sleep(PERIOD)

    def _step(self, follower: PersonFollower) -> FollowStep:
        try:
            robot: SE2 = self.tf.lookup(FRAME, "base_link")
        except TransformError as error:
            return FollowStep(0, f"The robot's pose is not known: {error}.", error_code=TF_ERROR)
        step = follower.step(robot, self.tracked_people.last, self.now_ns / 1e9)
        if self._fault and not step.error_code:
            return FollowStep(step.state, self._fault, error_code=FAILED_TO_CONTROL)
        return step

    def _act(self, step: FollowStep) -> None:
        if self._diverted:
            raise Cancelled
        if step.look_round:
            self._look_round()
        elif step.target is not None:
            self._drive_to(step.target)
        else:
            self._halt()

    def _end(self, result: nav2.FollowObject_Result) -> nav2.FollowObject_Result:
        self._publish_outcome(result.error_msg or "Following has ended.")
        return result
