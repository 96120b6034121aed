"""A navigator whose way is blocked: it waits, requests to pass, and goes on when the way is free."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.chefbot_msgs import (
    Cause,
    FindBlockage,
    FindBlockage_Goal,
    FindBlockage_Result,
    NavigationStatus,
)
from chefbot.msgs.chefbot_people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Pose, PoseStamped
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.sound_play import SoundRequest
from chefbot.msgs.std_msgs import Header
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
            way_around=self.extra_length >= 0.0,
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
def test_it_gives_up_after_its_patience_and_not_before(
    people: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    items = published(1200.0, monkeypatch, free=1e6, people=people)
    ended = [one.time_ns / 1e9 for one in items if isinstance(one.message, NavigationStatus)][-1]
    assert statuses(items)[-1].state == "idle" and statuses(items)[-1].reason
    assert 300.0 <= ended <= 700.0


@pytest.mark.parametrize(("extra_length", "waits"), [(2.0, False), (12.0, True)])
def test_the_quicker_of_two_ways_is_chosen_with_its_numbers(
    extra_length: float, waits: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(BlockedPlanner, "follows", 20.0)
    items = published(8.0, monkeypatch, free=100.0, extra_length=extra_length)
    assert any(one.state == "waiting" for one in statuses(items)) == waits
    causes = [one.message for one in items if isinstance(one.message, Cause)]
    decided = [one for one in causes if one.check == "blocked way" and one.kind in ("stop", "detour")][-1]
    assert decided.kind == ("stop" if waits else "detour")
    assert {"waited", "stood", "expected wait", "detour"} <= {one.name for one in decided.numbers}
