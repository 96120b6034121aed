"""A navigator whose path is blocked: it waits, requests to pass, and goes on when the path is free."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.behavior.recovery import NavigatorParams, WaitingParams
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.chefbot_msgs import (
    Cause,
    FindBlockage,
    FindBlockage_Goal,
    FindBlockage_Result,
    NavigationStatus,
)
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped, TransformStamped
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.sound_play import SoundRequest
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.navigation.blockage_request import ANSWER_TIMEOUT
from chefbot.nodes.navigation.path_waiting import HELD_UP_DISTANCE, STEP_ASIDE_TIME, PathWaitingNode
from chefbot.robot.load import load_robot
from chefbot.runtime.actions import action_server
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import Node, NoParams, Out, every
from chefbot.runtime.node_container import NodeContainer

NO_PATH = 208


class BlockedPlanner(Node):
    """A planner without a path until `free` seconds, because of `people`; a person stands there."""

    params: NoParams
    compute_path_to_pose = action_server(nav2.ComputePathToPose)
    find_blockage = action_server(FindBlockage)
    follow_path = action_server(nav2.FollowPath)
    spin = action_server(nav2.Spin)
    backup = action_server(nav2.BackUp)
    tracked_people: Out[TrackedPeople]
    free, extra_length, follows = 0.0, -1.0, 0.5
    people: tuple[int, ...] = (3,)

    @property
    def is_free(self) -> bool:
        return self.now_ns >= self.free * 1e9

    @every(hz=10)
    def track(self) -> None:
        people = (TrackedPerson(3, Point(2.0), standing=True),)
        self.tracked_people.publish(TrackedPeople(Header.of(self.now_ns, "odom"), people))

    async def on_compute_path_to_pose(self, _: Any, __: Any) -> nav2.ComputePathToPose_Result:
        if self.is_free or self.extra_length >= 0.0:
            return nav2.ComputePathToPose_Result(Path.of(Header.of(0, "map"), np.zeros((1, 3))))
        return nav2.ComputePathToPose_Result(error_code=NO_PATH, error_msg="no path")

    async def on_find_blockage(self, _: FindBlockage_Goal, __: Any) -> FindBlockage_Result:
        if self.is_free:
            return FindBlockage_Result()
        return FindBlockage_Result(
            blocked=True,
            people=np.array(self.people, np.uint32),
            alternative_path=self.extra_length >= 0.0,
            extra_length=max(self.extra_length, 0.0),
            point=Point(2.0),
            sensor="lidar",
        )

    async def on_follow_path(self, _: Any, __: Any) -> nav2.FollowPath_Result:
        await self.sleep(self.follows)
        return nav2.FollowPath_Result()

    async def on_spin(self, _: Any, __: Any) -> nav2.Spin_Result:
        return nav2.Spin_Result()

    async def on_backup(self, _: Any, __: Any) -> nav2.BackUp_Result:
        return nav2.BackUp_Result()


def published(seconds: float, monkeypatch: pytest.MonkeyPatch, **planner: object) -> list[Publication]:
    """Return what is published within some seconds of a goal."""
    for name, value in planner.items():
        monkeypatch.setattr(BlockedPlanner, name, value)
    system = NodeContainer(Loop(StepClock()), load_robot("chefbot_lidar"), 1)
    items: list[Publication] = []
    system.loop.add_observer(items.append)
    kinds = {"navigator": "chefbot.nodes.navigator:NavigatorNode", "planner": f"{__name__}:BlockedPlanner"}
    nodes = {name: NodeEntry(kind=kind) for name, kind in kinds.items()}
    system.launch(Launch(name="test", description="", args={}, nodes=nodes))
    system.loop.publish("goal_pose", PoseStamped(Header.of(0, "map"), Pose.of(SE2(5.0, 0.0, 0.0))), "test")
    system.loop.run(until_ns=round(seconds * 1e9))
    return items


def statuses(items: list[Publication]) -> list[NavigationStatus]:
    return [one.message for one in items if isinstance(one.message, NavigationStatus)]


def requests(items: list[Publication]) -> list[float]:
    return [one.time_ns / 1e9 for one in items if isinstance(one.message, SoundRequest)]


def test_it_requests_to_pass_and_goes_on_when_free(monkeypatch: pytest.MonkeyPatch) -> None:
    items = published(80.0, monkeypatch, free=60.0)
    times = requests(items)
    assert times[0] <= 10.0 and len(times) == 4 and np.diff(times).min() >= 15.0
    waiting = [one for one in statuses(items) if one.state == "waiting"]
    assert "Person 3 has stood in the way" in waiting[-1].reason and "May I pass" in waiting[-1].reason
    driving = next(one.time_ns for one in items if one.topic == "follow_path/_action/send_goal")
    assert 60.0 <= driving / 1e9 <= 62.0
    assert (statuses(items)[-1].state, statuses(items)[-1].reason) == ("idle", "")
    assert max(one.recoveries for one in statuses(items)) == 0


@pytest.mark.parametrize("people", [(3,), ()])
@pytest.mark.slow
def test_it_gives_up_after_its_patience_and_not_before(
    people: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    items = published(1200.0, monkeypatch, free=1e6, people=people)
    ended = [one.time_ns / 1e9 for one in items if isinstance(one.message, NavigationStatus)][-1]
    assert statuses(items)[-1].state == "idle" and statuses(items)[-1].reason
    assert 300.0 <= ended <= 700.0


@pytest.mark.parametrize(("extra_length", "waits"), [(2.0, False), (12.0, True)])
def test_the_quicker_of_two_paths_is_chosen_with_its_numbers(
    extra_length: float, waits: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(BlockedPlanner, "follows", 20.0)
    items = published(8.0, monkeypatch, free=100.0, extra_length=extra_length)
    assert any(one.state == "waiting" for one in statuses(items)) == waits
    causes = [one.message for one in items if isinstance(one.message, Cause)]
    decided = [one for one in causes if one.check == "blocked path" and one.kind in ("stop", "detour")][-1]
    assert decided.kind == ("stop" if waits else "detour")
    assert {"waited", "stood", "expected wait", "detour"} <= {one.name for one in decided.numbers}


# ---- the base class alone

GOAL = PoseStamped(Header.of(0, "map"), Pose.of(SE2(5.0, 0.0, 0.0)))
AGAIN = NavigatorParams(waiting=WaitingParams(request_after=3.0, request_period=5.0))


class Waiter(PathWaitingNode):
    """A node that waits when a test lets it; it keeps the results and the statuses that it publishes."""

    params: NavigatorParams

    def start(self) -> None:
        super().start()
        self.results: list[Any] = []
        self.states: list[tuple[str, str]] = []
        self._restart_waiting()

    @every(hz=10)
    def pass_time(self) -> None:
        """Let the time of the loop go on."""

    def wait(self, *, held_up: bool = False) -> None:
        self.spawn(self._keep(self._wait_for_path(GOAL, held_up)))

    def look(self, error_code: int = 0) -> None:
        self.spawn(self._keep(self._blocked_path(GOAL, error_code, False)))

    async def _keep(self, work: Any) -> None:
        self.results.append(await work)

    def _publish_status(self, state: str, reason: str) -> None:
        self.states.append((state, reason))


class PathPlanner(Node):
    """A planner that finds what a test sets in the way."""

    params: NoParams
    find_blockage = action_server(FindBlockage)
    found = FindBlockage_Result()

    async def on_find_blockage(self, _: FindBlockage_Goal, __: Any) -> FindBlockage_Result:
        return self.found


class PathAhead(NodeRunner):
    """A robot at the origin of odom, which looks along x, and a planner that knows what is in its way."""

    def __init__(self, *, planner: bool = True, params: NavigatorParams | None = None) -> None:
        nodes = {"waiter": f"{__name__}:Waiter"} | ({"planner": f"{__name__}:PathPlanner"} if planner else {})
        super().__init__(nodes, {})
        self.waiter: Any = self.system.nodes["waiter"]
        self.planner: Any = self.system.nodes.get("planner")
        if params is not None:
            self.waiter.params = params
        transform = TransformStamped.of(0, "odom", "base_link", IDENTITY)
        self.loop.publish("tf_static", TFMessage((transform,)), "test")
        self.run(0.0)

    def block(self, *people: int, extra_length: float = -1.0, sensor: str = "lidar") -> None:
        self.planner.found = FindBlockage_Result(
            blocked=True, people=np.array(people, np.uint32), alternative_path=extra_length >= 0.0,
            extra_length=max(extra_length, 0.0), point=Point(2.0), sensor=sensor,
        )  # fmt: skip

    def free(self) -> None:
        self.planner.found = FindBlockage_Result()

    def stand(self, x: float, seconds: float, *, number: int = 3, standing: bool = True) -> None:
        """Let a person stand ahead of the robot for some seconds."""
        for _ in range(round(10 * seconds)):
            person = TrackedPerson(number, Point(x), standing=standing)
            message = TrackedPeople(Header.of(self.loop.now_ns, "odom"), (person,))
            self.loop.publish("tracked_people", message, "tracker")
            self.run(0.1)

    @property
    def requested(self) -> list[float]:
        return [one.time_ns / 1e9 for one in self.published if isinstance(one.message, SoundRequest)]

    @property
    def causes(self) -> list[Cause]:
        return [one for one in self.messages("cause_reports") if one.kind != "end"]


@pytest.mark.parametrize(
    ("code", "alone", "among_people"),
    [
        (0, False, True),
        (205, True, True),
        (206, True, True),
        (208, True, True),
        (105, True, True),
        (106, True, True),
        (204, False, False),
        (104, False, False),
        (202, False, False),
    ],
)
def test_only_some_errors_may_be_people_in_the_way(code: int, alone: bool, among_people: bool) -> None:
    path = PathAhead()
    assert path.waiter._may_be_blocked(code) == alone
    path.stand(9.0, 0.1)
    assert path.waiter._may_be_blocked(code) == among_people


def test_a_planner_that_does_not_answer_finds_nothing() -> None:
    path = PathAhead(planner=False)
    path.waiter.look()
    path.run(ANSWER_TIMEOUT - 0.2)
    assert path.waiter.results == []
    path.run(0.4)
    assert path.waiter.results == [None]
    assert len(path.messages("find_blockage/_action/cancel_goal")) == 1


@pytest.mark.parametrize(("error", "x", "waits"), [
    (105, HELD_UP_DISTANCE - 0.1, True), (106, HELD_UP_DISTANCE - 0.1, True),
    (105, HELD_UP_DISTANCE + 0.1, False), (105, -0.5, False), (208, HELD_UP_DISTANCE - 0.1, False),
])  # fmt: skip
def test_somebody_before_a_held_up_robot_is_waited_for(error: int, x: float, waits: bool) -> None:
    path = PathAhead()
    path.stand(x, 0.1)
    path.waiter.look(error)
    path.run(0.1)
    assert (path.waiter.results[0] is not None) == waits, "although the plan is free"


def test_a_step_aside_is_waited_for_some_seconds() -> None:
    path = PathAhead()
    path.stand(0.8, 0.1)
    path.waiter.wait(held_up=True)
    path.stand(0.8, STEP_ASIDE_TIME - 0.5)
    assert path.waiter.results == []
    assert ("waiting", "Person 3 stands in front of the robot. Waiting.") in path.waiter.states
    path.stand(0.8, 2.0)
    assert path.waiter.results[0].error_code == 0, "then it tries to go on"


def test_the_wait_ends_with_the_path_and_its_causes() -> None:
    path = PathAhead()
    path.block(3)
    path.stand(2.0, 1.5)
    path.waiter.wait()
    path.stand(2.0, 2.5)
    assert path.waiter.results == [] and [one.check for one in path.causes] == ["blocked path"]
    path.free()
    path.stand(2.0, 1.1)
    assert path.waiter.results[0].error_code == 0
    assert [one.kind for one in path.messages("cause_reports")][-1] == "end"
    assert path.waiter.states[0] == ("driving", ""), "a recovery behavior is over"


def test_a_wait_without_another_path_ends_with_the_patience() -> None:
    params = NavigatorParams(waiting=WaitingParams(patience=10.0))
    path = PathAhead(params=params)
    path.block(3)
    path.waiter.wait()
    path.stand(2.0, 9.5)
    assert path.waiter.results == []
    path.stand(2.0, 2.0)
    (result,) = path.waiter.results
    assert result.error_code == NO_PATH and "there is no other path" in result.error_msg


def test_requests_are_repeated_at_their_period() -> None:
    path = PathAhead(params=AGAIN)
    path.block(3)
    path.stand(2.0, 1.5)
    path.waiter.wait()
    path.stand(2.0, 15.0)
    assert path.requested == pytest.approx([4.5, 9.5, 14.5], abs=0.15)
    assert [one.check for one in path.causes] == ["blocked path", "blocked path, requested to pass"]
    assert "Request: “May I pass, please?”" in path.waiter.states[-1][1]


def test_without_a_text_nothing_is_requested() -> None:
    path = PathAhead(params=NavigatorParams(waiting=WaitingParams(request="", request_after=0.0)))
    path.block(3)
    path.waiter.wait()
    path.stand(2.0, 5.0)
    assert path.requested == [] and "Request" not in path.waiter.states[-1][1]


@pytest.mark.parametrize(("pause", "requests"), [(4.0, 1), (12.0, 0)])
def test_waits_that_follow_closely_count_as_one(pause: float, requests: int) -> None:
    path = PathAhead(params=AGAIN)
    path.block(3)
    path.waiter.wait()
    path.stand(2.0, 2.0)
    path.free()
    path.stand(2.0, pause)
    path.block(3)
    path.waiter.wait()
    path.stand(2.0, 1.5)
    assert len(path.requested) == requests, "the first wait was 2 s, the request comes after 3 s"


def test_the_other_path_around_people_is_a_cause_if_it_is_long() -> None:
    for extra_length, notable in ((0.9, False), (1.1, True)):
        path = PathAhead()
        path.stand(2.0, 20.0)
        path.block(3, extra_length=extra_length)
        path.waiter.look()
        path.run(0.1)
        assert path.waiter.results == [None]
        assert [one.kind for one in path.causes] == (["detour"] if notable else [])


@pytest.mark.parametrize(
    ("people", "standing", "sensor", "located"),
    [
        ((3,), True, "lidar", True),
        ((3,), False, "lidar", False),
        ((), True, "lidar", True),
        ((), True, "", False),
    ],
)
def test_a_cause_names_the_cell_unless_somebody_walks_there(
    people: tuple[int, ...], standing: bool, sensor: str, located: bool
) -> None:
    path = PathAhead()
    path.stand(2.0, 3.0, standing=standing)
    path.block(*people, sensor=sensor)
    path.waiter.wait()
    path.run(0.2)
    (cause,) = path.causes
    assert cause.kind == "stop" and cause.located == located
    assert not located or (cause.sensor, cause.header.frame_id, cause.point.x) == ("lidar", "map", 2.0)
