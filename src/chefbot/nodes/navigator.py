"""Gets the robot to a pose: plan, follow, plan again every second, recover when stuck, say why it failed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from chefbot.behavior.recovery import CAREFUL, Recovery, RecoveryParams, order_for
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
from chefbot.runtime.actions import calls, serves
from chefbot.runtime.coroutines import Cancelled, Future, Task, first_of
from chefbot.runtime.node import In, Node, Out, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed

PATIENCE_EXCEEDED = 104
"""Error code of nav2_msgs/action/FollowPath: a sensor did not come back, or the robot did not find itself."""
HOPELESS = (204, PATIENCE_EXCEEDED)
"""Error codes that no recovery can mend; 204: the goal is outside the map."""
REACHED = 0
MOVING = ("driving", "recovering")
"""States in which the controller has something to do."""
NO_VALID_CONTROL = 106
"""Error code of nav2_msgs/action/FollowPath: here, that STOP is pressed."""
TELL_NS = 500_000_000
"""Between two words of how far it is."""
CREEPING = 0.01
"""m/s; at this speed the time that is left means nothing and is told as 0, as Nav2 does."""
LOOK_AGAIN = 1.0
"""Seconds that the sensors need to see again what is really there."""
PIECE = math.pi / 4
"""Radians that a lost robot turns between two looks at how sure it is."""
PIECES = 24
"""After three turns without finding itself it gives the goal up."""
SURE_FOR = 3
"""So many updates of localization in a row must be sure: two places can look alike for a moment."""
OTHERS = 2.0
"""Seconds that a lost robot lets others move it, as the finder does, before it turns on."""
LOST = "I am not sure where I am; turning on the spot to find out."
NOT_FOUND = (
    "I do not know where I am, after {} turns on the spot; say it on the page, or drive me on by hand."
)


class NavigatorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How patient it is."""

    replan_period: Annotated[float, Meta(ge=0.2, le=60, description="between two plans while driving, s")] = (
        1.0
    )
    recovery: RecoveryParams = RecoveryParams()


class NavigatorNode(Node):
    """Serves navigate_to_pose; also takes goals from `goal_pose`, as RViz's button gives them."""

    live_params = ("*",)  # from the next plan or recovery on
    params: NavigatorParams
    goal_pose: In[PoseStamped]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    localization_status: In[LocalizationStatus]
    standing: In[String] = topic("controller/standing")
    navigate_to_pose = serves(NavigateToPose)
    compute_path_to_pose = calls(ComputePathToPose)
    follow_path = calls(FollowPath)
    spin = calls(Spin)
    backup = calls(BackUp)
    own_goal = calls(NavigateToPose, "navigate_to_pose")
    clear_costmaps: Out[Float64]
    navigation_status: Out[NavigationStatus] = topic(latched=True)
    navigation_goal: Out[PoseStamped]

    def start(self) -> None:
        """Idle."""
        self._order = order_for(look_ahead_only=self.robot.sensors.look_ahead_only)
        self._recoveries = 0
        self._way = FollowPath_Feedback()
        self._told_ns = 0
        self._report: Callable[[], None] = lambda: None
        self._goal_task: Task[Any] | None = None
        self._state = ""
        self._sure = 0
        self._getting_lost: Future[None] = Future()
        self._tell("idle", "")

    def on_goal_pose(self, goal: PoseStamped) -> None:
        """A goal without an action: ours, so that everything goes the same way."""
        self._goal_task = self.spawn(self._own(goal))

    async def _own(self, goal: PoseStamped) -> None:
        await self.own_goal.call(NavigateToPose_Goal(goal))

    def on_cancel(self, _: Empty) -> None:
        """Stand still, whoever gave the goal."""
        self.navigate_to_pose.preempt()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """A stopped robot has no goal: nothing starts by itself when the button is released."""
        if pressed.data:
            self.navigate_to_pose.preempt()
        elif (self._state, self._reason) == ("idle", REFUSED):
            self._tell("idle", "")  # it is refused no longer

    def on_localization_status(self, status: LocalizationStatus) -> None:
        """Count how long it has been sure; wake who drives when it is not."""
        self._sure = self._sure + 1 if status.localized else 0
        if not status.localized:
            self._getting_lost.set(None)

    def on_standing(self, _: String) -> None:
        """The controller waits, or goes on."""
        if self._state in MOVING:
            self._tell(self._state, self._reason)

    def on_follow_path(self, feedback: FollowPath_Feedback) -> None:
        """Pass on how far it is, not as often as the controller says so."""
        self._way = feedback
        if self.now_ns - self._told_ns >= TELL_NS:
            self._report()

    async def on_navigate_to_pose(
        self, goal: NavigateToPose_Goal, feedback: Callable[[NavigateToPose_Feedback], None]
    ) -> NavigateToPose_Result:
        """Try, recover, try again."""
        if is_pressed(self.emergency_stop.last):
            self._tell("idle", REFUSED)
            return NavigateToPose_Result(NO_VALID_CONTROL, REFUSED)
        self._recoveries, began, self._way = 0, self.now_ns, FollowPath_Feedback()
        self._report = lambda: feedback(self._feedback(began))
        self.navigation_goal.publish(goal.pose)
        try:
            while True:
                self._report()
                outcome = await self._attempt(goal.pose)
                if outcome.error_code == REACHED:
                    self._tell("idle", "")
                    return NavigateToPose_Result()
                if (
                    self._recoveries >= self.params.recovery.rounds * len(self._order)
                    or outcome.error_code in HOPELESS
                ):
                    self._tell("idle", outcome.error_msg)
                    return NavigateToPose_Result(outcome.error_code, outcome.error_msg)
                await self._recover(outcome.error_msg)
        except Cancelled:
            self._tell("idle", "The goal was cancelled.")
            raise

    async def _attempt(self, goal: PoseStamped) -> FollowPath_Result:
        """Drive, with a new plan every `replan_period`, until the controller has done or given up."""
        following: Future[FollowPath_Result] | None = None
        try:
            while True:
                if self._is_lost:
                    if following is not None:
                        following.abandon()
                    fault = await self._find_itself()
                    if fault:
                        return FollowPath_Result(error_code=PATIENCE_EXCEEDED, error_msg=fault)
                planned = await self.compute_path_to_pose.call(ComputePathToPose_Goal(goal))
                if planned.error_code != 0:
                    return FollowPath_Result(error_code=planned.error_code, error_msg=planned.error_msg)
                self._tell("driving", "")
                following = self.follow_path.call(FollowPath_Goal(planned.path))
                self._getting_lost = Future()
                await first_of(following, self.sleep(self.params.replan_period), self._getting_lost)
                if following.done:
                    return following.result()
        finally:
            if following is not None:
                following.abandon()

    @property
    def _is_lost(self) -> bool:
        """As localization says, where there is one: a mapper says nothing."""
        status = self.localization_status.last
        return status is not None and not status.localized

    async def _find_itself(self) -> str:
        """Turn on the spot, which touches nothing, until localization has been sure for a while.

        Why it is still lost, a sentence; empty when it is not.
        """
        self._tell("recovering", LOST)
        for _ in range(PIECES):
            turned = await self._turn_a_piece()
            if self._sure >= SURE_FOR:
                return ""
            if turned is None:
                await self.sleep(OTHERS)
            elif turned.error_code:
                return turned.error_msg
        return NOT_FOUND.format(round(PIECES * PIECE / (2.0 * math.pi)))

    async def _turn_a_piece(self) -> Spin_Result | None:
        """None where somebody else's motion took the place of this one."""
        turning = self.spin.call(Spin_Goal(PIECE, Duration.of(15.0)))
        await first_of(turning)
        try:
            return turning.result()
        except Cancelled:
            return None

    async def _recover(self, reason: str) -> None:
        """The next remedy in the list."""
        recovery = self._order[self._recoveries % len(self._order)]
        self._recoveries += 1
        self._tell("recovering", reason)
        await self._do(recovery)

    async def _do(self, recovery: Recovery) -> None:
        params = self.params.recovery
        if recovery is Recovery.CLEAR:
            self.clear_costmaps.publish(Float64(params.clear_radius))
            await self.sleep(LOOK_AGAIN)
        elif recovery is Recovery.SPIN:
            await self.spin.call(Spin_Goal(params.spin, Duration.of(30.0)))
        elif recovery is Recovery.BACK_UP:
            speed = CAREFUL * max_speed(self.robot)
            await self.backup.call(BackUp_Goal(Point(-params.back_up), speed, Duration.of(10.0)))
        else:
            await self.sleep(params.wait)

    def _feedback(self, began_ns: int) -> NavigateToPose_Feedback:
        self._told_ns = self.now_ns
        spent = Duration.of((self.now_ns - began_ns) / 1e9)
        left, speed = self._way.distance_to_goal, self._way.speed
        rest = Duration.of(left / speed) if speed > CREEPING else Duration()
        return NavigateToPose_Feedback(self._here(), spent, rest, self._recoveries, left)

    def _here(self) -> PoseStamped:
        try:
            return PoseStamped(Header.of(self.now_ns, "map"), Pose.of(self.tf.lookup("map", "base_link")))
        except TransformError:
            return PoseStamped()  # not localized yet: an empty frame says so

    def _tell(self, state: str, reason: str) -> None:
        """What it does; while the controller stands, that it waits and for what."""
        self._state, self._reason = state, reason
        waits_for = self.standing.last.data if self.standing.last and state in MOVING else ""
        header = Header.of(self.now_ns, "map")
        told = ("waiting", waits_for) if waits_for else (state, reason)
        self.navigation_status.publish(NavigationStatus(header, told[0], self._recoveries, told[1]))
