"""Tests how the planner's costmap treats obstacles when the estimated pose jumps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.planner import PlanningError
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import DEVICE, Loop
from chefbot.runtime.node_container import NodeContainer

PERIOD = 100_000_000
AHEAD = 1.5


def lethal_cells(estimates: list[SE2]) -> set[tuple[int, int]]:
    """Return the lethal cells on an empty map for an obstacle 1.5 m ahead of a standing robot with these poses."""
    system = NodeContainer(Loop(StepClock()), load_robot("chefbot_lidar"), 1)
    entry = NodeEntry(kind="chefbot.nodes.planner:PlannerNode")
    system.launch(Launch(name="test", description="", args={}, nodes={"planner": entry}))
    costmaps: list[OccupancyGrid] = []
    system.loop.subscribe("global_costmap/costmap", "test", costmaps.append)

    def publish_sensors(i: int) -> None:
        now = system.loop.now_ns
        empty = Grid(np.zeros((200, 200), dtype=np.int8), 0.05, -5.0, -5.0)
        if i == 1:
            system.loop.publish("map", OccupancyGrid.of(Header.of(now, "map"), empty), "test")
        frames = [
            ("map", "odom", estimates[min(i // 5, len(estimates) - 1)]),
            ("odom", "base_link", SE2(0.0, 0.0, 0.0)),
        ]
        frames.append(("base_link", "laser", SE2(0.0, 0.0, 0.0)))
        transforms = tuple(TransformStamped.of(now, parent, child, pose) for parent, child, pose in frames)
        system.loop.publish("tf", TFMessage(transforms), "test")
        ranges = np.full(3, AHEAD, dtype=np.float32)
        header = Header.of(now, "laser")
        system.loop.publish("scan", LaserScan(header, -0.02, 0.02, 0.02, 0.0, 0.1, 0.1, 8.0, ranges), "test")

    for i in range(1, 5 * len(estimates) + 15):
        system.loop.schedule(i * PERIOD, DEVICE, lambda i=i: publish_sensors(i))
    system.loop.run(until_ns=(5 * len(estimates) + 15) * PERIOD)
    data = np.asarray(costmaps[-1].data).reshape(200, 200)
    rows, columns = np.nonzero(data == 100)
    return set(zip(columns.tolist(), rows.tolist(), strict=True))


def cell(x: float, y: float) -> tuple[int, int]:
    return math.floor((x + 5.0) / 0.05), math.floor((y + 5.0) / 0.05)


@pytest.mark.parametrize("wrong", [SE2(-2.0, 1.0, 0.0), SE2(0.0, 0.0, math.pi / 2)])
def test_obstacles_seen_from_a_wrong_pose_are_cleared(wrong: SE2) -> None:
    right = SE2(0.0, 0.0, 0.0)
    obstacle, wrong_mark = cell(AHEAD, 0.0), cell(*wrong.apply(np.array([[AHEAD, 0.0]]))[0])
    assert wrong_mark in lethal_cells([wrong])
    assert lethal_cells([wrong, right]) == lethal_cells([right])
    assert obstacle in lethal_cells([wrong, right])


def test_a_closed_door_out_of_sight_may_be_open_again() -> None:
    """A person stood in the door when the robot left the room."""
    cells = np.zeros((60, 200), dtype=np.int8)
    cells[:, [0, -1, 60]] = cells[[0, -1], :] = 100
    cells[25:37, 60] = 0
    costs = LayeredCostmap(CostmapParams(), disc(0.15))
    costs.set_static(Grid(cells, 0.05, 0.0, 0.0))
    costs.mark_and_clear("laser", SE2(4.0, 1.55, math.pi), np.linspace(-0.3, 0.3, 61), np.full(61, 1.0))
    planner, home = GridPlanner(), SE2(1.0, 1.5, 0.0)
    far, near = SE2(9.0, 1.5, 0.0), SE2(5.0, 1.5, 0.0)
    for start in (far, near):
        with pytest.raises(PlanningError):
            planner.plan(costs.update(), start, home)
    assert len(planner.plan(costs.costs_without_far_marks([far]), far, home)) > 10
    with pytest.raises(PlanningError):
        planner.plan(
            costs.costs_without_far_marks([near]), near, home
        )  # the door is in sight and the person still there


def test_a_small_pose_correction_clears_nothing() -> None:
    before, after = SE2(0.0, 0.0, 0.0), SE2(0.0, 0.3, 0.0)
    assert cell(AHEAD, 0.0) in lethal_cells([before, after]) and cell(AHEAD, 0.3) in lethal_cells(
        [before, after]
    )
