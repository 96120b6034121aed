"""The navigator's trees: what they begin, in which order, and when they give up."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from py_trees.common import Status
from tests.support.fake_navigation import (
    PendingAction,
    RecordedNavigation,
    blocked,
    no_path,
    path_found,
    unanswered,
)

from chefbot.behavior.recovery import NavigatorParams, RecoveryParams, WaitingParams
from chefbot.behavior_tree.blackboard import BehaviorTreeError
from chefbot.behavior_tree.navigation_tree import MAX_BYTES, NavigationTrees
from chefbot.behavior_tree.tree import BehaviorTree
from chefbot.msgs.chefbot_msgs import FindBlockage_Result
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import ComputePathToPose_Result, FollowPath_Result, Spin_Result
from chefbot.msgs.nav_msgs import Path as PathMessage
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot

LIDAR, CAMERA = load_robot("chefbot_lidar"), load_robot("chefbot")
ROUND = ["clear 2", "back up 0.2", "spin 6.28319", "wait 5"]
ROUND_LOOKING_AHEAD = ["spin 6.28319", "wait 5", "clear 2", "back up 0.2"]
Answer = Callable[[PendingAction], None]


def always(result: object) -> Answer:
    """Return an answer that lets recoveries end at once, and planning with `result`."""

    def answer(pending: PendingAction) -> None:
        if pending.what != "follow":
            pending.end(result if pending.what == "plan" else None)

    return answer


def finds_a_path(pending: PendingAction) -> None:
    if pending.what == "plan":
        pending.end(ComputePathToPose_Result(PathMessage()))


def finds_none(pending: PendingAction) -> None:
    if pending.what == "plan":
        pending.end(no_path())


class Navigation:
    """A tree with recorded services and a clock."""

    def __init__(self, answer: Answer, robot: object = LIDAR, params: NavigatorParams | None = None) -> None:
        self.services, self.params = RecordedNavigation(answer), params or NavigatorParams()
        self.trees = NavigationTrees(self.services, robot, self.params.behavior_tree)  # type: ignore[arg-type]
        self.tree: BehaviorTree = self.trees.new_tree(PoseStamped())
        self._now_ns = 0

    def run(self, seconds: float) -> Status:
        status = Status.RUNNING
        for _ in range(round(10 * seconds)):
            if status is Status.RUNNING:
                self.trees.set_params(self.tree, self.params)
                status = self.tree.tick(self._now_ns)
            self._now_ns += 100_000_000
        return status

    @property
    def recoveries(self) -> list[str]:
        return [name for name in self.services.names() if name not in ("plan", "follow", "relocalize")]


@pytest.mark.parametrize(("robot", "order"), [(LIDAR, ROUND), (CAMERA, ROUND_LOOKING_AHEAD)])
@pytest.mark.parametrize("rounds", [1, 3])
def test_each_recovery_has_its_turn_until_the_goal_fails(
    robot: object, order: list[str], rounds: int
) -> None:
    params = NavigatorParams(recovery=RecoveryParams(rounds=rounds))
    navigation = Navigation(always(no_path()), robot, params)
    assert navigation.run(1.0) is Status.FAILURE
    assert navigation.recoveries == rounds * order
    assert navigation.services.names().count("plan") == rounds * len(order) + 1
    assert set(navigation.services.failures) == {(208, "No path leads there.")}


@pytest.mark.parametrize("robot", [LIDAR, CAMERA])
def test_what_is_remembered_is_looked_at_before_other_recoveries(robot: object) -> None:
    def answer(pending: PendingAction) -> None:
        if pending.what == "back up to see":
            navigation.services.stopped_by_memory = False
        pending.end(no_path() if pending.what == "plan" else None)

    navigation = Navigation(answer, robot, NavigatorParams(recovery=RecoveryParams(rounds=1)))
    navigation.services.stopped_by_memory = True
    assert navigation.run(1.0) is Status.FAILURE
    order = ROUND if robot is LIDAR else ROUND_LOOKING_AHEAD
    assert navigation.recoveries == ["back up to see", *order[:-1]]


def test_nothing_is_tried_against_a_goal_outside_the_map() -> None:
    navigation = Navigation(
        always(ComputePathToPose_Result(error_code=204, error_msg="It is outside the map."))
    )
    assert navigation.run(1.0) is Status.FAILURE
    assert navigation.services.names() == ["plan"]


def test_it_plans_again_each_second_and_follows_each_path() -> None:
    navigation = Navigation(finds_a_path)
    assert navigation.run(5.05) is Status.RUNNING
    assert navigation.services.names() == ["plan", "follow"] * 5
    assert not any(one.discarded for one in navigation.services.begun), "the controller preempts by itself"
    navigation.services.begun[-1].end(FollowPath_Result())
    assert navigation.run(0.1) is Status.SUCCESS


def drives_at_once(pending: PendingAction) -> None:
    pending.end(path_found() if pending.what == "plan" else FollowPath_Result())


@pytest.mark.parametrize(("at_goal", "drives"), [(5.0, 6), (2.0, 3), (0.0, 1)])
def test_an_occupied_goal_is_tried_again_each_second(at_goal: float, drives: int) -> None:
    navigation = Navigation(drives_at_once, params=NavigatorParams(waiting=WaitingParams(at_goal=at_goal)))
    navigation.services.waits_well, navigation.services.goal_occupied = False, True
    assert navigation.run(at_goal + 2.0) is Status.SUCCESS
    drive = ["plan", "follow"]
    assert navigation.services.names() == [*drive * drives, "face", *drive], "the robot looks at it once"
    assert navigation.recoveries == ["face"]


def test_beside_an_occupied_goal_it_backs_up_to_see() -> None:
    def answer(pending: PendingAction) -> None:
        if pending.what == "follow" and navigation.services.stopped_by_memory:
            pending.end(blocked())
        elif pending.what == "back up to see":
            navigation.services.stopped_by_memory = False
            pending.end()
        else:
            drives_at_once(pending)

    navigation = Navigation(answer, params=NavigatorParams(waiting=WaitingParams(at_goal=0.0)))
    services = navigation.services
    services.waits_well, services.goal_occupied = False, True
    assert navigation.run(0.3) is Status.RUNNING and services.names() == ["plan", "follow", "face"]
    services.stopped_by_memory = True
    assert navigation.run(4.0) is Status.SUCCESS
    drive = ["plan", "follow"]
    assert services.names() == [*drive, "face", *drive, "back up to see", *drive]


def test_a_goal_with_nothing_to_look_at_is_near_enough() -> None:
    def answer(pending: PendingAction) -> None:
        if pending.what == "face":
            pending.end(Spin_Result(error_code=700, error_msg="Nothing occupies the goal."))
        else:
            drives_at_once(pending)

    navigation = Navigation(answer, params=NavigatorParams(waiting=WaitingParams(at_goal=0.0)))
    navigation.services.waits_well, navigation.services.goal_occupied = False, True
    assert navigation.run(2.0) is Status.SUCCESS
    assert navigation.services.names() == ["plan", "follow", "face"]
    assert navigation.services.failures == []


def test_a_goal_that_becomes_free_is_reached_at_once() -> None:
    navigation = Navigation(drives_at_once)
    navigation.services.waits_well, navigation.services.goal_occupied = False, True
    assert navigation.run(1.5) is Status.RUNNING
    navigation.services.goal_occupied = False
    assert navigation.run(1.0) is Status.SUCCESS
    assert navigation.services.names() == ["plan", "follow"] * 3


def test_a_goal_within_the_tolerance_ends_the_drive() -> None:
    """The controller's tolerance may be larger than the distance at which the robot is at a pose."""
    navigation = Navigation(drives_at_once)
    navigation.services.waits_well = False
    assert navigation.run(0.5) is Status.SUCCESS
    assert navigation.services.names() == ["plan", "follow"]


def test_a_recovery_that_fails_is_followed_by_a_plan() -> None:
    def answer(pending: PendingAction) -> None:
        pending.end(blocked() if pending.what.startswith(("spin", "back", "follow")) else path_found())

    navigation = Navigation(answer)
    assert navigation.run(1.0) is Status.FAILURE
    assert navigation.recoveries == 2 * ROUND
    assert navigation.services.failures[-1] == (105, "Something is in the way.")


def test_a_lost_robot_stops_following_until_it_is_localized() -> None:
    navigation = Navigation(finds_a_path)
    navigation.run(0.5)
    navigation.services.localized = False
    navigation.run(2.0)
    following, relocalizing = navigation.services.begun[-2:]
    assert (following.what, relocalizing.what) == ("follow", "relocalize") and following.discarded
    navigation.services.localized = True
    relocalizing.end(FollowPath_Result())
    navigation.run(0.2)
    assert navigation.services.names()[-2:] == ["plan", "follow"]


def test_a_lost_robot_that_stays_lost_gives_up() -> None:
    navigation = Navigation(unanswered)
    navigation.services.localized = False
    navigation.run(0.5)
    navigation.services.begun[-1].end(FollowPath_Result(error_code=204, error_msg="Not localized."))
    assert navigation.run(0.5) is Status.FAILURE
    assert navigation.services.names() == ["relocalize"]


def test_a_tree_that_is_halted_cancels_what_it_has_begun() -> None:
    navigation = Navigation(finds_a_path)
    navigation.run(1.05)
    navigation.tree.halt()
    assert navigation.services.begun[-1].discarded and navigation.tree.pending == []


def test_parameters_count_from_the_next_recovery_on() -> None:
    navigation = Navigation(finds_none)
    navigation.run(0.2)
    navigation.params = NavigatorParams(recovery=RecoveryParams(back_up=0.5, spin=math.pi))
    navigation.services.begun[-1].end()
    navigation.run(0.2)
    assert navigation.recoveries == ["clear 2", "back up 0.5"]


def in_the_way() -> FindBlockage_Result:
    return FindBlockage_Result(blocked=True, waiting_pose=PoseStamped(Header.of(0, "map")))


def blocked_by_people(waits: int) -> Answer:
    """Return an answer of a planner without a path, which finds people in the way for the first `waits` times."""
    looks = iter([in_the_way()] * waits)

    def answer(pending: PendingAction) -> None:
        if pending.what == "look":
            pending.end(next(looks, None))
        elif pending.what == "wait for path":
            pending.end(ComputePathToPose_Result())
        elif pending.what != "follow":
            pending.end(no_path() if pending.what == "plan" else None)

    return answer


@pytest.mark.parametrize("waits", [1, 50])
def test_waiting_for_people_uses_no_recovery_up(waits: int) -> None:
    navigation = Navigation(blocked_by_people(waits))
    navigation.services.may_be_blocked = True
    assert navigation.run(120.0) is Status.FAILURE
    names = navigation.services.names()
    assert names.count("wait for path") == waits and names[:3] == ["plan", "look", "wait for path"]
    recoveries = [name for name in names if name not in ("plan", "look", "wait for path")]
    assert recoveries == 2 * ROUND


def test_a_robot_in_a_doorway_leaves_it_while_it_waits() -> None:
    def answer(pending: PendingAction) -> None:
        if pending.what == "look":
            pending.end(in_the_way())
        elif pending.what == "plan":
            pending.end(no_path() if navigation.services.names().count("plan") == 1 else path_found())

    navigation = Navigation(answer)
    navigation.services.may_be_blocked, navigation.services.waits_well = True, False
    assert navigation.run(1.0) is Status.RUNNING
    assert navigation.services.names() == ["plan", "look", "wait for path", "plan", "follow"]
    waiting, following = navigation.services.begun[2], navigation.services.begun[4]
    navigation.services.may_be_blocked = False
    waiting.end(ComputePathToPose_Result())
    navigation.run(0.5)
    assert following.discarded, "the path is free: it does not drive to the waiting pose any more"
    assert navigation.services.names()[5:] == ["plan", "follow"]


def test_it_stops_for_people_although_there_is_a_longer_path() -> None:
    def answer(pending: PendingAction) -> None:
        if pending.what in ("look", "plan"):
            pending.end(in_the_way() if pending.what == "look" else path_found())

    navigation = Navigation(answer)
    navigation.run(0.5)
    assert navigation.services.names() == ["plan", "follow"]
    navigation.services.may_be_blocked = True
    navigation.run(1.0)
    assert navigation.services.names()[2:] == ["plan", "look", "look", "wait for path"]
    assert navigation.services.begun[1].discarded


@given(
    st.lists(
        st.sampled_from(["path", "no path", "blocked", "reached", "nothing", "lost", "found"]), max_size=30
    )
)
def test_at_most_one_motion_at_a_time(events: list[str]) -> None:
    """Whatever ends, in whatever order: what moves the robot was begun after all else had ended or was cancelled."""
    navigation = Navigation(unanswered)
    results = {
        "path": path_found(),
        "no path": no_path(),
        "blocked": blocked(),
        "reached": FollowPath_Result(),
    }
    for event in events:
        if event in ("lost", "found"):
            navigation.services.localized = event == "found"
        waiting = [one for one in navigation.services.begun if not one.done and not one.discarded]
        if event in results and waiting and (waiting[-1].what == "plan") == ("path" in event):
            waiting[-1].end(results[event])
        if navigation.run(0.3) is not Status.RUNNING:
            break
        moving = [one for one in navigation.tree.pending if one.what != "plan"]  # type: ignore[attr-defined]
        assert len(moving) <= 1


def test_a_tree_of_a_file_is_run_instead(tmp_path: Path) -> None:
    file = tmp_path / "mine.xml"
    file.write_text(
        '<root BTCPP_format="4"><BehaviorTree ID="Mine"><Sequence><Wait wait_duration="2.5"/>'
        '<Spin spin_dist="1.5"/></Sequence></BehaviorTree></root>'
    )
    navigation = Navigation(lambda pending: pending.end(), params=NavigatorParams(behavior_tree=str(file)))
    assert navigation.run(0.5) is Status.SUCCESS
    assert navigation.services.names() == ["wait 2.5", "spin 1.5"]


def test_a_file_that_is_not_a_tree_is_refused_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(BehaviorTreeError, match=r"absent\.xml: cannot be read: No such file"):
        Navigation(always(None), params=NavigatorParams(behavior_tree=str(tmp_path / "absent.xml")))
    large = tmp_path / "large.xml"
    large.write_bytes(b" " * (MAX_BYTES + 1))
    with pytest.raises(BehaviorTreeError, match="has more than 1000000 bytes"):
        Navigation(always(None), params=NavigatorParams(behavior_tree=str(large)))


@pytest.mark.parametrize(("start", "request_"), [('start="{goal}"', "plan from start"), ("", "plan")])
def test_a_path_begins_at_the_start_that_is_given(tmp_path: Path, start: str, request_: str) -> None:
    file = tmp_path / "tree.xml"
    file.write_text(
        '<root BTCPP_format="4"><BehaviorTree ID="T">'
        f'<ComputePathToPose goal="{{goal}}" {start} path="{{path}}"/></BehaviorTree></root>'
    )
    navigation = Navigation(finds_a_path, params=NavigatorParams(behavior_tree=str(file)))
    navigation.run(0.2)
    assert navigation.services.names() == [request_]
