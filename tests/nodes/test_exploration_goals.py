"""When an exploration chooses its next goal, and where goals are not: on obstacles that only the planner knows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.exploration.blockages import INSCRIBED
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, TransformStamped
from chefbot.msgs.nav2_msgs import (
    NavigateToPose,
    NavigateToPose_Goal,
    NavigateToPose_Result,
    Spin,
    Spin_Goal,
    Spin_Result,
)
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.exploration.drives import CHECK_PERIOD
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams

MAP_PERIOD = 2.0
"""Period of the maps, s."""
HEADER = Header.of(0, "map")
GOAL = SE2(0.275, -0.025, 0.0)
"""The first goal on a square of free floor of 3 m."""
EXPLORER = "chefbot.nodes.explorer:ExplorerNode"


class Arrives(Node):
    """A navigator that is at its goal at once."""

    params: NoParams
    spin, navigate_to_pose = action_server(Spin), action_server(NavigateToPose)
    time_to_goal = 0.0

    def start(self) -> None:
        self.goals: list[SE2] = []
        self.began: list[float] = []
        self.ended: list[float] = []

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        return Spin_Result()

    async def on_navigate_to_pose(self, goal: NavigateToPose_Goal, _: Any) -> NavigateToPose_Result:
        self.goals.append(goal.pose.pose.se2)
        self.began.append(self.now_ns / 1e9)
        try:
            await self.sleep(self.time_to_goal)
        finally:
            self.ended.append(self.now_ns / 1e9)
        return NavigateToPose_Result()


class OnTheWay(Arrives):
    """A navigator with a long way to its goals."""

    time_to_goal = 1000.0


def free_floor(width: int) -> Grid:
    """A square of free floor of so many cells, which is open on all sides."""
    cells = np.full((160, 160), UNKNOWN, np.int8)
    cells[80 - width // 2 : 80 + width // 2, 80 - width // 2 : 80 + width // 2] = FREE
    return Grid(cells, 0.05, -4.0, -4.0)


def marks_at(pose: SE2) -> OccupancyGrid:
    """The costmap of a planner that sees an obstacle at a pose; it has another extent than the map."""
    cells = np.zeros((20, 20), np.int8)
    cells[4:16, 4:16] = INSCRIBED
    return OccupancyGrid.of(HEADER, Grid(cells, 0.05, pose.x - 0.5, pose.y - 0.5))


def runner_with(navigator: str) -> NodeRunner:
    runner = NodeRunner({"explorer": EXPLORER, "navigator": navigator}, {}, {"explorer": {"go_home": False}})
    transform = TransformStamped.of(0, "map", "base_link", IDENTITY)
    runner.loop.publish("tf_static", TFMessage((transform,)), "test", from_device=True)
    return runner


@pytest.mark.parametrize(("navigator", "wait"), [("Arrives", MAP_PERIOD), ("OnTheWay", 0.0)])
def test_after_each_goal_it_waits_for_one_map_at_the_longest(navigator: str, wait: float) -> None:
    """Of a frontier that is mapped before the robot is there, the map shows the result already."""
    runner = runner_with(f"{__name__}:{navigator}")
    for step in range(16):
        grid = OccupancyGrid.of(HEADER, free_floor(40 + 6 * step))
        runner.loop.publish("map", grid, "test", from_device=True)
        runner.run(MAP_PERIOD)
    drives: Any = runner.system.nodes["navigator"]
    pauses = [begin - end for end, begin in zip(drives.ended, drives.began[1:], strict=False)]
    assert len(pauses) > 2 and max(pauses) <= wait + 0.1


@pytest.mark.parametrize("known_before", [False, True])
def test_goals_are_not_where_only_the_planner_knows_an_obstacle(known_before: bool) -> None:
    """One on which an obstacle is seen on the way is given up."""
    runner = runner_with(f"{__name__}:OnTheWay")
    if known_before:
        runner.loop.publish("global_costmap/costmap", marks_at(GOAL), "test", from_device=True)
    runner.loop.publish("map", OccupancyGrid.of(HEADER, free_floor(60)), "test", from_device=True)
    runner.run(2.0 * MAP_PERIOD)
    drives: Any = runner.system.nodes["navigator"]
    first = drives.goals[0]
    assert (first.distance(GOAL) < 0.01) is not known_before
    runner.loop.publish("global_costmap/costmap", marks_at(first), "test", from_device=True)
    runner.run(CHECK_PERIOD + MAP_PERIOD)
    assert drives.ended and drives.goals[1].distance(first) > 0.2


def drives_to_occupied_goals(person: bool) -> int:
    """Return to how many goals on one square of free floor the robot drives if on each one an obstacle is seen."""
    runner = runner_with(f"{__name__}:OnTheWay")
    drives: Any = runner.system.nodes["navigator"]
    for _ in range(400):
        runner.loop.publish("map", OccupancyGrid.of(HEADER, free_floor(60)), "test", from_device=True)
        for goal in drives.goals[-1:]:
            place = TrackedPerson(3, Point(goal.x, goal.y))
            people = TrackedPeople(Header.of(runner.loop.now_ns, "map"), (place,) if person else ())
            runner.loop.publish("tracked_people", people, "test", from_device=True)
            runner.loop.publish("global_costmap/costmap", marks_at(goal), "test", from_device=True)
        runner.run(0.5 * MAP_PERIOD)
    assert runner.messages("exploration_status")[-1].done
    return len(drives.goals)


def test_a_goal_that_a_person_occupies_is_tried_again() -> None:
    """Whoever walks beside the robot is at one goal after the other; that shows nothing about a frontier."""
    assert drives_to_occupied_goals(person=True) > 2 * drives_to_occupied_goals(person=False)


def test_a_robot_among_obstacles_that_go_explores_on() -> None:
    """As people do who stood around it for a while."""
    runner, grid = runner_with(f"{__name__}:OnTheWay"), free_floor(60)
    drives: Any = runner.system.nodes["navigator"]
    cells = grid.cells.copy()
    cells[75:85, [75, 84]] = cells[[75, 84], 75:85] = OCCUPIED
    for step in range(8):
        enclosed = Grid(cells, grid.resolution, grid.origin_x, grid.origin_y)
        message = OccupancyGrid.of(HEADER, enclosed if step < 6 else grid)
        runner.loop.publish("map", message, "test", from_device=True)
        runner.run(MAP_PERIOD)
        assert bool(drives.goals) == (step >= 6)
    sentences = [status.description for status in runner.messages("exploration_status")]
    assert "Exploration waits: obstacles enclose the robot." in sentences
