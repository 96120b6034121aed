"""Waits for a way that is blocked: reports why, requests to pass, and compares waiting with the other way."""

from __future__ import annotations

from functools import cached_property

from chefbot.behavior.recovery import NavigatorParams
from chefbot.behavior.waiting import StandingTimes, WaitDecision, WaitingPolicy, person_ahead
from chefbot.causes.reports import DETOUR, STOP, MarkedPlace, make_report
from chefbot.msgs.chefbot_msgs import Cause, FindBlockage, FindBlockage_Goal, FindBlockage_Result
from chefbot.msgs.chefbot_people import TrackedPeople
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import ComputePathToPose_Result
from chefbot.msgs.sound_play import SoundRequest, speech
from chefbot.nodes.causes.reports import CauseReportsNode
from chefbot.nodes.navigation.path_request import PathRequestNode
from chefbot.robot.motion_limits import max_speed
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import wait_any
from chefbot.runtime.node import In, Out
from chefbot.runtime.transform_buffer import TransformError

NO_VALID_PATH = 208
"""Error code of nav2_msgs/action/ComputePathToPose."""
BLOCKED_PATHS = (205, 206, 208)
"""Error codes of ComputePathToPose of ways that people may block: start or goal occupied, no valid path."""
HELD_UP = (105, 106)
"""Error codes of FollowPath of a robot that something near holds up: no progress, no valid control."""
NEAR = 1.3
"""Distance of a person before the robot who may hold it up, m."""
STEP_ASIDE = 6.0
"""Time for which the robot waits for a person before it although its plan leads past, s."""
LOOK_TIMEOUT = 2.0
"""Time in which the planner has to answer what blocks a way, s."""
PAUSE_NS = 10_000_000_000
"""Time between two waits up to which they count as one until the request to pass, ns."""
PERIOD = 1.0
"""Time between two looks whether the way is free, s."""
BLOCKED, REQUESTED = "blocked way", "blocked way, requested to pass"
"""Names of the checks in causes."""
NOTABLE_DETOUR = 1.0
"""Extra length of a way around people from which it is reported, m."""


class WayWaitingNode(PathRequestNode, CauseReportsNode):
    """Base class of a node that waits for blocked ways."""

    params: NavigatorParams
    tracked_people: In[TrackedPeople]
    find_blockage = action_client(FindBlockage)
    robotsound: Out[SoundRequest]

    @cached_property
    def _standing(self) -> StandingTimes:
        return StandingTimes()

    def _restart_waiting(self) -> None:
        """Begin a goal with all patience."""
        self.end_reports()
        self._policy = WaitingPolicy(max_speed(self.robot))

    _requested_ns: int | None = None
    _waits_since_ns = _waited_ns = -PAUSE_NS - 1

    def on_tracked_people(self, message: TrackedPeople) -> None:
        """Note since when everybody stands."""
        self._standing.process(message)

    def _may_be_blocked(self, error_code: int) -> bool:
        """Return whether the planner may know what blocks the way after this error, 0 for none."""
        return error_code in (*BLOCKED_PATHS, *HELD_UP) or (error_code == 0 and self._standing.anybody)

    async def _look(self, goal: PoseStamped, *, find_waiting_pose: bool = False) -> FindBlockage_Result:
        """Return what blocks the way; nothing if the planner does not answer."""
        looking = self.find_blockage.call(FindBlockage_Goal(goal, find_waiting_pose))
        await wait_any(looking, self.sleep(LOOK_TIMEOUT))
        if looking.done:
            return looking.result()
        looking.discard()
        return FindBlockage_Result()

    async def _blocked_way(
        self, goal: PoseStamped, error_code: int, find_waiting_pose: bool
    ) -> FindBlockage_Result | None:
        """Return what the robot should wait for, or None."""
        found = await self._look(goal, find_waiting_pose=find_waiting_pose)
        self._policy.begin()
        decision = self._decide(found)
        notable = len(found.people) and found.way_around and found.extra_length >= NOTABLE_DETOUR
        takes_other = notable and not decision.waits
        self.report("other way", _cause(DETOUR, BLOCKED, decision, found) if takes_other else None)
        if decision.waits:
            return found
        patient = self._waited_for < self.params.waiting.patience
        return found if error_code in HELD_UP and patient and self._person_ahead() is not None else None

    @property
    def _waited_for(self) -> float:
        """Time since the first of the waits that follow each other closely, s; 0 if the last one is long ago."""
        paused = self.now_ns - self._waited_ns > PAUSE_NS
        return 0.0 if paused else (self.now_ns - self._waits_since_ns) / 1e9

    async def _wait_for_way(self, goal: PoseStamped, held_up: bool) -> ComputePathToPose_Result:
        """Wait until the way is free or another one is quicker; an error if it takes too long.

        held_up: whether somebody stands before the robot although its plan leads past.
        """
        began_ns = self.now_ns
        self._waits_since_ns = began_ns - round(1e9 * self._waited_for)
        self._publish_status("driving", "")  # a recovery behavior is over
        try:
            while True:
                found = await self._look(goal)
                decision = self._decide(found)
                if decision.gives_up:
                    return ComputePathToPose_Result(error_code=NO_VALID_PATH, error_msg=decision.sentence)
                person = self._person_ahead() if held_up and not decision.waits else None
                if person is not None and self.now_ns - began_ns < STEP_ASIDE * 1e9:
                    decision = WaitDecision(True, sentence=f"Person {person} stands before me. I wait.")
                if not decision.waits:
                    return ComputePathToPose_Result()
                self._waited_ns = self.now_ns
                requested = self._request()
                decision = decision._replace(sentence=f"{decision.sentence} {requested}".rstrip())
                self.report("way", _cause(STOP, REQUESTED if requested else BLOCKED, decision, found))
                self._publish_status("waiting", decision.sentence)
                await self.sleep(PERIOD)
        finally:
            self.end_reports()

    def _decide(self, found: FindBlockage_Result) -> WaitDecision:
        return self._policy.decide(found, self._standing, self.now_ns / 1e9, self.params.waiting)

    def _person_ahead(self) -> int | None:
        """Return the number of the person before the robot's front, or None."""
        tracked = self.tracked_people.last
        if tracked is None:
            return None
        try:
            robot = self.tf.lookup(tracked.header.frame_id, "base_link")
        except TransformError:
            return None
        return person_ahead(tracked, robot, NEAR)

    def _request(self) -> str:
        """Request to pass, if it is time, and return the request as a sentence."""
        params, now_ns = self.params.waiting, self.now_ns
        if not params.request or self._waited_for < params.request_after:
            return ""
        if self._requested_ns is None or now_ns - self._requested_ns >= params.request_period * 1e9:
            self._requested_ns = now_ns
            self.robotsound.publish(speech(params.request))
        return f"Request: “{params.request}”"

    def _publish_status(self, state: str, reason: str) -> None:
        """Publish what the node does, and why."""


def _cause(kind: str, check: str, decision: WaitDecision, found: FindBlockage_Result) -> Cause:
    """Return the report of a decision with its numbers, and the cell in the way unless that is somebody who walks."""
    point, marked_ns = found.point, found.marked_at.ns
    stands = any(one.name == "stood" and one.value > 0.0 for one in decision.numbers)
    located = bool(found.sensor) and (stands or not len(found.people))
    place = MarkedPlace(found.sensor, "map", point.x, point.y, marked_ns) if located else None
    return make_report(kind, check, decision.sentence, place, decision.numbers)
