"""Viewpoints of an exploration lie where the robot has room; a passage in which it just fits is only a way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.costs import INSCRIBED
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage

RESOLUTION = 0.05
ROOM, SLOT, END = 40, 8, 100
"""Columns of the room; rows of the slot that begins there, and the column at which it ends, in cells."""


def slot(*, room_behind: bool) -> Grid:
    """A room of 2 x 2 m, and a slot of 0.4 m at its side that ends in unknown floor, or in a room with a frontier."""
    cells = np.full((60, 180), UNKNOWN, np.int8)
    cells[10:50, :ROOM] = FREE
    cells[26 : 26 + SLOT, ROOM:END] = FREE
    cells[[9, 50], : ROOM + 1] = cells[9:51, 0] = OCCUPIED
    cells[9:26, ROOM] = cells[26 + SLOT : 51, ROOM] = OCCUPIED
    cells[[25, 26 + SLOT], ROOM:END] = OCCUPIED
    if room_behind:
        cells[10:50, END:160] = FREE
        cells[[9, 50], END:160] = OCCUPIED
        cells[9:26, END] = cells[26 + SLOT : 51, END] = OCCUPIED
    return Grid(cells, RESOLUTION, 0.0, -1.5)


@pytest.mark.parametrize("room_behind", [False, True])
def test_no_viewpoint_lies_in_a_slot(room_behind: bool) -> None:
    grid = slot(room_behind=room_behind)
    runner = NodeRunner({"explorer": "chefbot.nodes.explorer:ExplorerNode"}, {})
    transform = TransformStamped.of(0, "map", "base_link", SE2(1.0, 0.0, 0.0))
    runner.loop.publish("tf_static", TFMessage((transform,)), "test", from_device=True)
    runner.loop.publish("map", OccupancyGrid.of(Header.of(0, "map"), grid), "test", from_device=True)
    runner.run(0.1)
    explorer: Any = runner.system.nodes["explorer"]
    goal = explorer._decide().goal
    costs = explorer._costs_of(grid).update()
    if room_behind:
        assert goal.pose.x > END * RESOLUTION, "through the slot, and not in it"
    assert goal is None or costs.at(goal.pose.x, goal.pose.y) < INSCRIBED
