"""Tests the order of the recovery behaviors of a robot without a path."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import FindBlockage, FindBlockage_Goal, FindBlockage_Result
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import (
    BackUp,
    BackUp_Goal,
    BackUp_Result,
    ComputePathToPose,
    ComputePathToPose_Goal,
    ComputePathToPose_Result,
    FollowPath,
    FollowPath_Goal,
    FollowPath_Result,
    Spin,
    Spin_Goal,
    Spin_Result,
)
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.runtime.actions import action_server
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import Node, NoParams
from chefbot.runtime.node_container import NodeContainer

NO_PATH = 208


class NoPath(Node):
    """A planner that finds no path, and behaviors that succeed at once."""

    params: NoParams
    compute_path_to_pose = action_server(ComputePathToPose)
    find_blockage = action_server(FindBlockage)
    follow_path = action_server(FollowPath)
    spin = action_server(Spin)
    backup = action_server(BackUp)

    async def on_compute_path_to_pose(self, _: ComputePathToPose_Goal, __: Any) -> ComputePathToPose_Result:
        """Fail with NO_PATH."""
        return ComputePathToPose_Result(error_code=NO_PATH, error_msg="no path")

    async def on_find_blockage(self, _: FindBlockage_Goal, __: Any) -> FindBlockage_Result:
        """Find nothing that may go away."""
        return FindBlockage_Result()

    async def on_follow_path(self, _: FollowPath_Goal, __: Any) -> FollowPath_Result:
        """Succeed at once."""
        return FollowPath_Result()

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        """Succeed at once."""
        return Spin_Result()

    async def on_backup(self, _: BackUp_Goal, __: Any) -> BackUp_Result:
        """Succeed at once."""
        return BackUp_Result()


def published_by(robot: str, tree: str = "") -> list[Publication]:
    """Return what is published while a navigator without a path has a goal; `tree` is the file of its tree."""
    system = NodeContainer(Loop(StepClock()), load_robot(robot), 1)
    published: list[Publication] = []
    system.loop.add_observer(published.append)
    kinds = {"navigator": "chefbot.nodes.navigator:NavigatorNode", "no_path": f"{__name__}:NoPath"}
    nodes = {name: NodeEntry(kind=kind) for name, kind in kinds.items()}
    nodes["navigator"] = NodeEntry(kind=kinds["navigator"], params={"behavior_tree": tree})
    system.launch(Launch(name="test", description="", args={}, nodes=nodes))
    goal = PoseStamped(Header.of(0, "map"), Pose.of(SE2(1.0, 0.0, 0.0)))
    system.loop.publish("goal_pose", goal, "test")
    system.loop.run(until_ns=60_000_000_000)
    return published


def recoveries(robot: str) -> list[str]:
    """Return the recovery behaviors in the order in which a navigator without a path starts them."""
    behaviors = {
        "clear_costmaps": "clear",
        "spin/_action/send_goal": "spin",
        "backup/_action/send_goal": "back",
    }
    return [behaviors[item.topic] for item in published_by(robot) if item.topic in behaviors]


@pytest.mark.parametrize(
    ("robot", "order"),
    [("chefbot_lidar", ["clear", "back", "spin"]), ("chefbot", ["spin", "clear", "back"])],
)
def test_a_forward_sensor_robot_spins_before_clearing_or_backup(robot: str, order: list[str]) -> None:
    assert recoveries(robot) == [*order, *order]


def test_the_feedback_counts_recoveries_without_a_path() -> None:
    """Without a path there is no feedback of the controller either."""
    topic = "navigate_to_pose/_action/feedback"
    feedback: list[Any] = [item.message for item in published_by("chefbot_lidar") if item.topic == topic]
    assert [one.feedback.number_of_recoveries for one in feedback] == list(range(len(feedback)))
    assert len(feedback) > 6


def test_each_decision_of_the_tree_is_published() -> None:
    logs = [item.message for item in published_by("chefbot") if item.topic == "behavior_tree_log"]
    events = [event for log in logs for event in log.event_log]  # type: ignore[attr-defined]
    failed = [
        event
        for event in events
        if (event.node_name, event.current_status) == ("NavigateRecovery", "FAILURE")
    ]
    begun = {event.node_name for event in events if event.current_status == "RUNNING"}
    assert len(failed) == 1 and {"Spin", "Wait", "BackUp", "ClearCostmapAroundRobot"} <= begun


def test_a_tree_that_reads_what_nobody_wrote_ends_the_goal(tmp_path: Path) -> None:
    file = tmp_path / "mine.xml"
    file.write_text(
        '<root BTCPP_format="4"><BehaviorTree ID="Mine"><Wait wait_duration="{tme}"/></BehaviorTree></root>'
    )
    statuses = [one.message for one in published_by("chefbot", str(file)) if one.topic == "navigation_status"]
    assert statuses[-1].state == "idle"  # type: ignore[attr-defined]
    assert "The behavior tree failed: the blackboard has no 'tme'" in statuses[-1].reason  # type: ignore[attr-defined]
