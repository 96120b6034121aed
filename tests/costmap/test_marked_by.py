"""Who marked a cell, and when: of several sensors the last, and the static map where no sensor did."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.costmap.layer import CellMark
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.layers import STATIC
from chefbot.costmap.params import LOCAL_COSTMAP, CostmapParams
from chefbot.costmap.ranger_marks import contact_radius, mark_contact
from chefbot.costmap.sources import CAMERA, CONTACT, LASER
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.robot.load import load_robot

AHEAD = np.zeros(1)


def seen(costs: LayeredCostmap, source: str, distance: float, time: float) -> None:
    costs.set_time(time)
    costs.mark_and_clear(source, IDENTITY, AHEAD, np.array([distance]))


@pytest.fixture(params=[LOCAL_COSTMAP, CostmapParams()], ids=["decays", "stays"])
def costs(request: pytest.FixtureRequest) -> LayeredCostmap:
    return LayeredCostmap(request.param, disc(0.2), rolling=True)


def test_the_last_of_several_sensors_is_named(costs: LayeredCostmap) -> None:
    assert costs.marked_by(1.02, 0.02) is None
    seen(costs, LASER, 1.02, 10.0)
    seen(costs, CAMERA, 1.02, 10.4)
    assert costs.marked_by(1.02, 0.02) == CellMark(CAMERA, 10.4)
    seen(costs, LASER, 1.02, 10.5)
    assert costs.marked_by(1.02, 0.02) == CellMark(LASER, 10.5)
    assert set(costs.marks(1.02, 0.02)) == {CellMark(CAMERA, 10.4), CellMark(LASER, 10.5)}
    seen(costs, LASER, 2.0, 11.0)  # the laser sees through; the camera's mark stays
    assert costs.marked_by(1.02, 0.02) == CellMark(CAMERA, 10.4)


def test_a_mark_moves_with_the_window(costs: LayeredCostmap) -> None:
    seen(costs, LASER, 1.02, 3.0)
    costs.move_to(0.9, -0.4)
    assert costs.marked_by(1.02, 0.02) == CellMark(LASER, 3.0)
    assert costs.marked_by(0.52, 0.02) is None
    assert (
        costs.marks(50.0, 0.0) == []
        and costs.marked_by(50.0, 0.0) is None
        and costs.marked_by(-50.0, -50.0) is None
    )


def test_what_the_robot_touched_is_named(costs: LayeredCostmap) -> None:
    costs.set_time(7.0)
    robot = load_robot("chefbot")
    mark_contact(costs, SE2(0.0, 0.0, 0.0), contact_radius(robot))
    assert costs.marked_by(contact_radius(robot), 0.0) == CellMark(CONTACT, 7.0)


def test_the_map_is_named_where_no_sensor_marked() -> None:
    costs = LayeredCostmap(CostmapParams(), disc(0.2))
    cells = np.zeros((40, 40), np.int8)
    cells[:, 30] = 100
    costs.set_static(Grid(cells, 0.05, 0.0, 0.0))
    assert costs.marked_by(1.52, 1.0) == CellMark(STATIC, 0.0)
    costs.set_time(2.0)
    costs.mark_and_clear(LASER, SE2(1.0, 1.02, 0.0), AHEAD, np.array([0.52]))
    assert costs.marked_by(1.52, 1.02) == CellMark(LASER, 2.0)
    assert costs.marked_by(0.5, 0.5) is None


def test_the_costs_of_the_map_alone_have_no_marks() -> None:
    costs = LayeredCostmap(CostmapParams(), disc(0.2))
    costs.set_static(Grid(np.zeros((40, 40), np.int8), 0.05, 0.0, 0.0))
    costs.mark_and_clear(LASER, SE2(1.0, 1.02, 0.0), AHEAD, np.array([0.52]))
    assert costs.update().at(1.52, 1.02) == 254 and costs.static_costs().at(1.52, 1.02) == 0


def test_a_map_that_grows_keeps_who_marked() -> None:
    costs = LayeredCostmap(CostmapParams(), disc(0.2))
    costs.set_static(Grid(np.zeros((40, 40), np.int8), 0.05, 0.0, 0.0))
    costs.set_time(4.0)
    costs.mark_and_clear(LASER, SE2(1.0, 1.02, 0.0), AHEAD, np.array([0.52]))
    costs.set_static(Grid(np.zeros((80, 60), np.int8), 0.05, -1.0, -1.0))
    mark = costs.marked_by(1.52, 1.02)
    assert mark is not None and mark.source == LASER and math.isclose(mark.time, 4.0)
