"""An exploration during a fault of the robot: it waits, blames no frontier, and ends if the fault lasts."""

from __future__ import annotations

from typing import Any

import numpy as np
from tests.support.nodes import NodeRunner

from chefbot.exploration.session import WAITS
from chefbot.maths.grid import FREE, UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY
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
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.exploration.reports import FAULT_PATIENCE
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams

FAULT = "The left wheel is blocked."


class Immobile(Node):
    """A navigator whose goals all fail."""

    params: NoParams
    spin, navigate_to_pose = action_server(Spin), action_server(NavigateToPose)

    def start(self) -> None:
        self.goals = 0

    async def on_spin(self, _: Spin_Goal, __: Any) -> Spin_Result:
        return Spin_Result()

    async def on_navigate_to_pose(self, _: NavigateToPose_Goal, __: Any) -> NavigateToPose_Result:
        self.goals += 1
        await self.sleep(10.0)
        return NavigateToPose_Result(104, "It cannot drive.")


class Exploration:
    """An explorer in a square of free floor that is open on all sides."""

    def __init__(self) -> None:
        kinds = {"explorer": "chefbot.nodes.explorer:ExplorerNode", "navigator": f"{__name__}:Immobile"}
        self.runner = NodeRunner(kinds, {}, {"explorer": {"go_home": False}})
        transform = TransformStamped.of(0, "map", "base_link", IDENTITY)
        self.publish("tf_static", TFMessage((transform,)))

    def publish(self, topic: str, message: Any) -> None:
        self.runner.loop.publish(topic, message, "test", from_device=True)

    def run(self, seconds: float, fault: str) -> None:
        cells = np.full((80, 80), UNKNOWN, np.int8)
        cells[20:60, 20:60] = FREE
        for _ in range(round(seconds / 2.0)):
            self.publish("map", OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, -2.0, -2.0)))
            self.publish("base/stop_reason", String(fault))
            self.runner.run(2.0)

    @property
    def goals(self) -> int:
        navigator: Any = self.runner.system.nodes["navigator"]
        return int(navigator.goals)

    @property
    def notices(self) -> list[str]:
        return [notice.data for notice in self.runner.messages("explorer/notice")]

    @property
    def status(self) -> Any:
        return self.runner.messages("exploration_status")[-1]


def test_goals_fail_without_a_fault_because_of_their_frontiers() -> None:
    exploration = Exploration()
    exploration.run(400.0, "")
    assert exploration.status.done
    assert any("failed" in frontier for frontier in exploration.status.skipped_frontiers)
    [result] = exploration.notices
    assert result.startswith("Not everything is seen: all attempts failed near (")


def test_a_fault_pauses_the_exploration() -> None:
    exploration = Exploration()
    exploration.run(FAULT_PATIENCE - 60.0, FAULT)
    assert exploration.goals == 1 and not exploration.status.done
    assert exploration.status.description == WAITS + FAULT
    exploration.run(10.0, "")
    assert exploration.goals == 2, "the same frontier is tried again"
    assert exploration.status.description == "Exploring."
    assert not any("failed" in frontier for frontier in exploration.status.skipped_frontiers)


def test_a_fault_that_lasts_ends_the_exploration() -> None:
    exploration = Exploration()
    exploration.run(FAULT_PATIENCE + 60.0, FAULT)
    assert exploration.goals == 1 and exploration.status.done
    assert exploration.status.description == f"Exploration ended: {FAULT}"
    assert exploration.notices == [exploration.status.description]
