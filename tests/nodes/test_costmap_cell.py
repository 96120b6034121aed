"""A cell of a costmap as a message: all that marked it, from the top layer down."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.sources import CAMERA, LASER
from chefbot.maths.costs import LETHAL
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.navigation.costmap_cell import cell_message
from chefbot.robot.load import load_robot


def test_all_that_marked_a_cell_is_named() -> None:
    costs = LayeredCostmap(CostmapParams(), disc(0.2))
    cells = np.zeros((40, 40), np.int8)
    cells[:, 30] = 100
    costs.set_static(Grid(cells, 0.05, 0.0, 0.0))
    for time, source in ((2.0, LASER), (3.5, CAMERA)):
        costs.set_time(time)
        costs.mark_and_clear(source, SE2(1.0, 1.02, 0.0), np.zeros(1), np.array([0.52]))
    cell = cell_message(Header.of(4, "map"), costs, SE2(1.52, 1.02, 0.0), load_robot("chefbot_lidar"))
    assert (cell.point.x, cell.point.y) == pytest.approx((1.525, 1.025))
    assert cell.inside and cell.cost == LETHAL
    marks = {mark.source: mark.marked_at.ns / 1e9 for mark in cell.marks}
    assert marks == {"lidar": 2.0, "depth camera": 3.5, "map": 0.0}
