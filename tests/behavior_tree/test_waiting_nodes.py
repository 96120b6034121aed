"""Leaves that wait for a blocked path: what they ask for, and what they make of the answers."""

from __future__ import annotations

import pytest
from py_trees.common import Status
from tests.support.fake_navigation import PendingAction, RecordedNavigation
from tests.support.scripted_trees import run

from chefbot.behavior_tree.bt_xml import build_tree, read_tree_file
from chefbot.behavior_tree.catalog import CONTROL_NODES
from chefbot.behavior_tree.tree import BehaviorTree
from chefbot.behavior_tree.waiting_nodes import waiting_nodes
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import FindBlockage_Result
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import ComputePathToPose_Result, Spin_Result
from chefbot.msgs.std_msgs import Header

GOAL = PoseStamped(Header.of(0, "map"), Pose.of(SE2(4.0, 1.0, 0.0)))
PLACE = PoseStamped(Header.of(0, "map"), Pose.of(SE2(2.0, 3.0, 0.0)))


class NavigationWithArguments(RecordedNavigation):
    """Records the arguments of its requests, too."""

    def __init__(self) -> None:
        super().__init__()
        self.arguments: list[tuple[object, ...]] = []

    def find_blocked_path(
        self, goal: object, error_code: int, find_waiting_pose: bool
    ) -> PendingAction | None:
        self.arguments.append((goal, error_code, find_waiting_pose))
        return super().find_blocked_path(goal, error_code, find_waiting_pose)

    def wait_for_path(self, goal: object, error_code: int) -> PendingAction:
        self.arguments.append((goal, error_code))
        return super().wait_for_path(goal, error_code)

    def face_obstacle(self, goal: object) -> PendingAction:
        self.arguments.append((goal,))
        return super().face_obstacle(goal)

    def is_at(self, pose: object) -> bool:
        self.arguments.append((pose,))
        return super().is_at(pose)


@pytest.fixture
def services() -> NavigationWithArguments:
    services = NavigationWithArguments()
    services.may_be_blocked = True
    return services


def tree_of(services: NavigationWithArguments, body: str) -> BehaviorTree:
    text = f'<root BTCPP_format="4"><BehaviorTree ID="T">{body}</BehaviorTree></root>'
    tree = build_tree(read_tree_file(text.encode(), "t.xml"), {**CONTROL_NODES, **waiting_nodes(services)})
    tree.blackboard.set("goal", GOAL)
    return tree


@pytest.mark.parametrize(
    ("ports", "arguments"),
    [
        ("", (GOAL, 0, False)),
        (' error_code="208"', (GOAL, 208, False)),
        (' waiting_pose="{place}"', (GOAL, 0, True)),
    ],
)
def test_a_search_requests_a_place_only_where_it_is_used(
    services: NavigationWithArguments, ports: str, arguments: tuple[object, ...]
) -> None:
    tree = tree_of(services, f'<IsPathBlocked goal="{{goal}}"{ports}/>')
    assert run(tree, 2) == "RR" and services.arguments == [arguments]


def test_a_blocked_path_is_a_success_with_the_place_to_wait(services: NavigationWithArguments) -> None:
    tree = tree_of(services, '<IsPathBlocked goal="{goal}" waiting_pose="{place}"/>')
    assert run(tree, 1) == "R" and tree.blackboard.find("place") is None
    services.begun[-1].end(FindBlockage_Result(blocked=True, waiting_pose=PLACE))
    assert run(tree, 1) == "S" and tree.blackboard.get("place") is PLACE


def test_a_path_not_to_wait_for_is_a_failure(services: NavigationWithArguments) -> None:
    tree = tree_of(services, '<IsPathBlocked goal="{goal}" waiting_pose="{place}"/>')
    run(tree, 1)
    services.begun[-1].end(None)
    assert run(tree, 1) == "F" and tree.blackboard.find("place") is None
    services.may_be_blocked = False
    assert run(tree, 1) == "F" and services.names() == ["look"], "where nothing can be, nobody looks"


def test_a_wait_ends_with_the_path_or_with_its_error(services: NavigationWithArguments) -> None:
    body = '<WaitForPath goal="{goal}" error_code="{seen}" error_code_id="{code}" error_msg="{text}"/>'
    for result, status in (
        (ComputePathToPose_Result(), "S"),
        (ComputePathToPose_Result(error_code=208, error_msg="It is still closed."), "F"),
    ):
        tree = tree_of(services, body)
        tree.blackboard.set("seen", 105)
        assert run(tree, 1) == "R" and services.arguments[-1] == (GOAL, 105)
        services.begun[-1].end(result)
        assert run(tree, 1) == status
        assert tree.blackboard.get("code") == result.error_code
        assert tree.blackboard.get("text") == result.error_msg
    assert services.failures == [(208, "It is still closed.")], "the reason of the goal's failure"


def test_a_wait_that_is_halted_is_cancelled(services: NavigationWithArguments) -> None:
    tree = tree_of(services, '<WaitForPath goal="{goal}"/>')
    run(tree, 1)
    tree.halt()
    assert services.begun[-1].discarded and services.arguments == [(GOAL, 0)]


def test_facing_an_obstacle_ends_with_the_rotation(services: NavigationWithArguments) -> None:
    for result, status in ((Spin_Result(), "S"), (Spin_Result(error_code=703, error_msg="Blocked."), "F")):
        tree = tree_of(services, '<FaceObstacle goal="{goal}" error_msg="{text}"/>')
        assert run(tree, 1) == "R" and services.arguments[-1] == (GOAL,)
        services.begun[-1].end(result)
        assert run(tree, 1) == status and tree.blackboard.get("text") == result.error_msg
    assert services.failures == [], "without it the goal is near enough"


def test_a_reached_goal_is_that_of_the_port(services: NavigationWithArguments) -> None:
    tree = tree_of(services, '<GoalReached goal="{place}"/>')
    tree.blackboard.set("place", PLACE)
    for reached, status in ((True, Status.SUCCESS), (False, Status.FAILURE)):
        services.waits_well = reached
        assert tree.tick(0) is status and services.arguments[-1] == (PLACE,)
