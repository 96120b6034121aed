"""An exploration with a navigator that gets stuck: it gives up first drives to a frontier early, later ones not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from tests.support.nodes import NodeRunner

from chefbot.maths.grid import FREE, UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.nav2_msgs import (
    NavigateToPose,
    NavigateToPose_Feedback,
    NavigateToPose_Goal,
    NavigateToPose_Result,
    Spin,
    Spin_Goal,
    Spin_Result,
)
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.exploration.drives import CHECK_PERIOD, FIRST_RECOVERIES, LATER_RECOVERIES
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams

RECOVERY, RECOVERIES = 5.0, 8
"""Time of a recovery of the navigator, s, and how many it tries."""


class Stuck(Node):
    """A navigator that recovers in vain."""

    params: NoParams
    spin, navigate_to_pose = action_server(Spin), action_server(NavigateToPose)

    def start(self) -> None:
        self.drives: list[float] = []
        """How long each drive has lasted, s."""

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        return Spin_Result()

    async def on_navigate_to_pose(
        self, _: NavigateToPose_Goal, feedback: Callable[[NavigateToPose_Feedback], None]
    ) -> NavigateToPose_Result:
        begin_ns = self.now_ns
        try:
            for count in range(1, RECOVERIES + 1):
                feedback(NavigateToPose_Feedback(number_of_recoveries=count))
                await self.sleep(RECOVERY)
        finally:
            self.drives.append((self.now_ns - begin_ns) / 1e9)
        return NavigateToPose_Result(208, "No path leads there.")


def explored(half: float, fault: str = "") -> tuple[list[float], Any]:
    """Return the durations of the drives in an open square of free floor, and the last status.

    half: distance of its sides from the robot in its middle, m.
    """
    kinds = {"explorer": "chefbot.nodes.explorer:ExplorerNode", "navigator": f"{__name__}:Stuck"}
    runner = NodeRunner(kinds, {}, {"explorer": {"go_home": False}})
    cells, side = np.full((160, 160), UNKNOWN, np.int8), round(half / 0.05)
    cells[80 - side : 80 + side, 80 - side : 80 + side] = FREE
    grid = OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, -4.0, -4.0))
    messages = {"map": grid, "base/stop_reason": String(fault)}
    transform = TransformStamped.of(0, "map", "base_link", IDENTITY)
    runner.loop.publish("tf_static", TFMessage((transform,)), "test", from_device=True)
    for _ in range(400):
        for topic, message in messages.items():
            runner.loop.publish(topic, message, "test", from_device=True)
        runner.run(2.0)
    navigator: Any = runner.system.nodes["navigator"]
    return navigator.drives, runner.messages("exploration_status")[-1]


def test_the_first_drive_to_each_frontier_is_given_up_early() -> None:
    drives, status = explored(2.5)
    assert status.done and any("failed 2 times" in frontier for frontier in status.skipped_frontiers)
    early = [drive for drive in drives if drive <= FIRST_RECOVERIES * RECOVERY + CHECK_PERIOD]
    assert len(early) == len(drives) / 2, "two drives to each frontier"
    later = {drive for drive in drives if drive not in early}
    assert later and all(0.0 <= drive - LATER_RECOVERIES * RECOVERY <= CHECK_PERIOD for drive in later)


def test_near_a_goal_one_recovery_is_enough_to_look_from_there() -> None:
    drives, status = explored(1.4)
    assert status.done and any("failed 2 times" in frontier for frontier in status.skipped_frontiers)
    assert drives[:2] == [CHECK_PERIOD] * 2, "the first goals of the frontiers are 0.2 m away"


def test_giving_up_during_a_fault_blames_no_frontier() -> None:
    drives, status = explored(1.4, "The left wheel is blocked.")
    assert len(drives) == 1 and not any("failed" in frontier for frontier in status.skipped_frontiers)
