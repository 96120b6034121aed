"""Waits for a path that is blocked: reports why, requests to pass, and compares waiting with the other path."""

from __future__ import annotations

from functools import cached_property

from chefbot.behavior.pass_requests import PassRequests
from chefbot.behavior.recovery import NavigatorParams
from chefbot.behavior.waiting import StandingTimes, WaitDecision, WaitingPolicy, person_ahead
from chefbot.causes.blocked_path import BLOCKED, REQUESTED, blocked_path_report
from chefbot.causes.reports import DETOUR, STOP
from chefbot.msgs.chefbot_msgs import Cause, FindBlockage_Result
from chefbot.msgs.chefbot_msgs.people import TrackedPeople
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import ComputePathToPose_Result
from chefbot.msgs.sound_play import SoundRequest, speech
from chefbot.nodes.causes.reports import CauseReportsNode
from chefbot.nodes.navigation.blockage_request import BlockageRequestNode
from chefbot.nodes.navigation.path_request import PathRequestNode
from chefbot.robot.motion_limits import max_speed
from chefbot.runtime.node import In, Out
from chefbot.runtime.transform_buffer import TransformError

NO_VALID_PATH = 208
"""Error code of nav2_msgs/action/ComputePathToPose."""
BLOCKED_PATH_ERRORS = (205, 206, 208)
"""Error codes of ComputePathToPose for paths that people may block: start or goal occupied, no valid path."""
HELD_UP_ERRORS = (105, 106)
"""Error codes of FollowPath of a robot that something near holds up: no progress, no valid control."""
HELD_UP_DISTANCE = 1.3
"""Distance within which a person in front of the robot may hold it up, m."""
STEP_ASIDE_TIME = 6.0
"""Time for which the robot waits for a person before it although its plan leads past, s."""
PERIOD = 1.0
"""Time between two checks whether the path is free, s."""
NOTABLE_DETOUR = 1.0
"""Extra length of a path around people from which it is reported, m."""


class PathWaitingNode(PathRequestNode, BlockageRequestNode, CauseReportsNode):
    """Base class of a node that waits for blocked paths."""

    params: NavigatorParams
    tracked_people: In[TrackedPeople]
    robotsound: Out[SoundRequest]

    @cached_property
    def _standing(self) -> StandingTimes:
        return StandingTimes()

    @cached_property
    def _requests(self) -> PassRequests:
        return PassRequests()

    def _restart_waiting(self) -> None:
        """Reset patience for a new goal."""
        self.end_reports()
        self._policy = WaitingPolicy(max_speed(self.robot))

    def on_tracked_people(self, message: TrackedPeople) -> None:
        """Update since when each person stands."""
        self._standing.process(message)

    def _may_be_blocked(self, error_code: int) -> bool:
        """Return whether the planner may know what blocks the path after this error, 0 for none."""
        return error_code in (*BLOCKED_PATH_ERRORS, *HELD_UP_ERRORS) or (
            error_code == 0 and self._standing.anybody
        )

    async def _blocked_path(
        self, goal: PoseStamped, error_code: int, find_waiting_pose: bool
    ) -> FindBlockage_Result | None:
        """Return what the robot should wait for, or None."""
        found = await self._find_blockage(goal, find_waiting_pose=find_waiting_pose)
        self._policy.begin()
        decision = self._decide(found)
        notable = len(found.people) and found.alternative_path and found.extra_length >= NOTABLE_DETOUR
        takes_other = notable and not decision.waits
        self.report("other path", _report(DETOUR, BLOCKED, decision, found) if takes_other else None)
        if decision.waits:
            return found
        patient = self._requests.waited(self.now_ns) < self.params.waiting.patience
        return (
            found if error_code in HELD_UP_ERRORS and patient and self._person_ahead() is not None else None
        )

    async def _wait_for_path(self, goal: PoseStamped, held_up: bool) -> ComputePathToPose_Result:
        """Wait until the path is free or another one is quicker; an error if it takes too long.

        held_up: whether a person stands in front of the robot although its plan leads past.
        """
        began_ns = self.now_ns
        self._requests.begin(began_ns)
        self._publish_status("driving", "")  # a recovery behavior is over
        try:
            while True:
                found = await self._find_blockage(goal)
                decision = self._decide(found)
                if decision.gives_up:
                    return ComputePathToPose_Result(error_code=NO_VALID_PATH, error_msg=decision.sentence)
                person = self._person_ahead() if held_up and not decision.waits else None
                if person is not None and self.now_ns - began_ns < STEP_ASIDE_TIME * 1e9:
                    decision = WaitDecision(
                        True, sentence=f"Person {person} stands in front of the robot. Waiting."
                    )
                if not decision.waits:
                    return ComputePathToPose_Result()
                self._requests.wait(self.now_ns)
                requested = self._request()
                decision = decision._replace(sentence=f"{decision.sentence} {requested}".rstrip())
                self.report(
                    "blocked path", _report(STOP, REQUESTED if requested else BLOCKED, decision, found)
                )
                self._publish_status("waiting", decision.sentence)
                await self.sleep(PERIOD)
        finally:
            self.end_reports()

    def _decide(self, found: FindBlockage_Result) -> WaitDecision:
        return self._policy.decide(found, self._standing, self.now_ns / 1e9, self.params.waiting)

    def _person_ahead(self) -> int | None:
        """Return the number of the person in front of the robot, or None."""
        tracked = self.tracked_people.last
        if tracked is None:
            return None
        try:
            robot = self.tf.lookup(tracked.header.frame_id, "base_link")
        except TransformError:
            return None
        return person_ahead(tracked, robot, HELD_UP_DISTANCE)

    def _request(self) -> str:
        """Request to pass, if it is time, and return the request as a sentence."""
        params = self.params.waiting
        if not self._requests.are_due(self.now_ns, params):
            return ""
        if self._requests.take(self.now_ns, params):
            self.robotsound.publish(speech(params.request))
        return f"Request: “{params.request}”"

    def _publish_status(self, state: str, reason: str) -> None:
        """Publish what the node does, and why."""


def _report(kind: str, check: str, decision: WaitDecision, found: FindBlockage_Result) -> Cause:
    return blocked_path_report(kind, check, decision.sentence, decision.numbers, found)
