"""An explorer before glass: the map shows floor behind it, and only the planner's costmap what is in the way."""

from __future__ import annotations

from typing import Any

import numpy as np
from tests.support.nodes import NodeRunner

from chefbot.exploration.dead_ends import MAX_DRIVES
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
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
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams

RESOLUTION = 0.05
GLASS = 3.0
"""The glass is at this x, m; the robot begins on the side of x = 0."""


def floor() -> Grid:
    """A corridor of 8 x 2 m along x with walls at its sides, and unknown floor beside it behind the glass."""
    cells = np.full((60, 160), UNKNOWN, np.int8)
    cells[20:40] = FREE
    cells[[19, 40], :60] = OCCUPIED
    cells[19:41, 0] = cells[19:41, -1] = OCCUPIED
    return Grid(cells, RESOLUTION, 0.0, -1.5)


def costs(*, glass: bool) -> Grid:
    cells = np.where(floor().cells == OCCUPIED, OCCUPIED, FREE).astype(np.int8)
    if glass:
        cells[19:41, round(GLASS / RESOLUTION)] = OCCUPIED
    return Grid(cells, RESOLUTION, 0.0, -1.5)


class Glazed(Node):
    """A navigator that drives at once to goals before the glass, and fails at those behind it."""

    params: NoParams
    spin, navigate_to_pose = action_server(Spin), action_server(NavigateToPose)

    def start(self) -> None:
        self.failed: list[SE2] = []

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        return Spin_Result()

    async def on_navigate_to_pose(self, goal: NavigateToPose_Goal, _: Any) -> NavigateToPose_Result:
        pose = goal.pose.pose.se2
        if pose.x < GLASS:
            return NavigateToPose_Result()
        self.failed.append(pose)
        return NavigateToPose_Result(208, "No path leads there.")


def explored(*, glass_on_costmap: bool) -> tuple[list[SE2], bool]:
    """Return the goals behind the glass that were tried, and whether the exploration has ended after 10 minutes."""
    kinds = {"explorer": "chefbot.nodes.explorer:ExplorerNode", "world": f"{__name__}:Glazed"}
    runner = NodeRunner(kinds, {}, {"explorer": {"go_home": False}})
    transform = TransformStamped.of(0, "map", "base_link", SE2(2.0, 0.0, 0.0))
    runner.loop.publish("tf_static", TFMessage((transform,)), "test", from_device=True)
    header = Header.of(0, "map")
    grid = OccupancyGrid.of(header, costs(glass=glass_on_costmap))
    runner.loop.publish("global_costmap/costmap", grid, "test", from_device=True)
    for _ in range(300):
        runner.loop.publish("map", OccupancyGrid.of(header, floor()), "test", from_device=True)
        runner.run(2.0)
    world: Any = runner.system.nodes["world"]
    return world.failed, bool(runner.messages("exploration_status")[-1].done)


def test_after_one_failure_nothing_behind_glass_is_a_goal() -> None:
    failed, done = explored(glass_on_costmap=True)
    assert done and len(failed) == 1
    without, _ = explored(glass_on_costmap=False)
    assert len(without) == MAX_DRIVES, "then the way there is a dead end"
