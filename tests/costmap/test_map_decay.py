"""Marks in the costmap of the map decay only while the robot is near enough to see them."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import GLOBAL_COSTMAP
from chefbot.costmap.ranger_marks import mark_contact
from chefbot.costmap.sources import CAMERA, CONTACT, CONTACT_TIME, DROP_OFFS, LASER
from chefbot.maths.costs import LETHAL
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

HERE, FAR = SE2(2.0, 2.0, 0.0), SE2(15.0, 2.0, 0.0)
AHEAD, ASIDE = np.zeros(1), np.full(1, 3.0)


@pytest.fixture
def costs() -> LayeredCostmap:
    costs = LayeredCostmap(GLOBAL_COSTMAP, disc(0.2))
    costs.set_static(Grid(np.zeros((80, 400), np.int8), 0.05, 0.0, 0.0))
    return costs


def see(costs: LayeredCostmap, source: str, sensor: SE2, time: float, angles: np.ndarray = AHEAD) -> None:
    costs.set_time(time)
    costs.mark_and_clear(source, sensor, angles, np.array([1.02]))


def is_marked(costs: LayeredCostmap) -> bool:
    return costs.update().at(3.02, 2.02) == LETHAL


@pytest.mark.parametrize("source", [LASER, CAMERA, DROP_OFFS])
def test_what_could_be_seen_and_is_not_confirmed_goes(costs: LayeredCostmap, source: str) -> None:
    see(costs, source, HERE, 10.0)
    for time in range(11, 70):
        see(costs, LASER, HERE, float(time), ASIDE)
    assert is_marked(costs)
    for time in range(70, 74):
        see(costs, LASER, HERE, float(time), ASIDE)
    assert not is_marked(costs)
    assert costs.marked_by(3.02, 2.02) is None


def test_what_is_seen_stays(costs: LayeredCostmap) -> None:
    for time in range(10, 200):
        see(costs, LASER, HERE, float(time))
    assert is_marked(costs)


def test_what_is_far_stays_and_time_starts_again_when_it_is_near(costs: LayeredCostmap) -> None:
    see(costs, CAMERA, HERE, 10.0)
    for time in range(11, 500):
        see(costs, LASER, FAR, float(time))
    assert is_marked(costs)
    for time in range(500, 555):
        see(costs, LASER, HERE, float(time), ASIDE)
    assert is_marked(costs)
    for time in range(555, 565):
        see(costs, LASER, HERE, float(time), ASIDE)
    assert not is_marked(costs)


def test_what_no_other_sensor_sees_stays(costs: LayeredCostmap) -> None:
    costs.source_cells(CONTACT)[40, 60] = LETHAL
    costs.note_change(SE2(3.02, 2.02, 0.0), 0.1)
    for time in range(10, 200):
        see(costs, LASER, HERE, float(time), ASIDE)
    assert is_marked(costs)


def test_a_contact_is_forgotten_after_a_while(costs: LayeredCostmap) -> None:
    """Perhaps somebody has moved a chair into a doorway, and back."""
    costs.set_time(5.0)
    mark_contact(costs, SE2(3.0, 2.0, 0.0), 0.2)
    costs.set_time(CONTACT_TIME)
    assert (costs.source_cells(CONTACT) == LETHAL).any()
    costs.set_time(CONTACT_TIME + 7.0)
    assert not (costs.source_cells(CONTACT) == LETHAL).any()


def test_only_the_window_of_what_went_is_updated(
    costs: LayeredCostmap, monkeypatch: pytest.MonkeyPatch
) -> None:
    from chefbot.costmap import layers

    see(costs, CAMERA, HERE, 10.0)
    costs.update()
    sizes: list[int] = []
    inflate = layers.inflate

    def record_size(cells: np.ndarray, table: np.ndarray) -> np.ndarray:
        sizes.append(cells.size)
        return inflate(cells, table)

    monkeypatch.setattr("chefbot.costmap.layers.inflate", record_size)
    costs.set_time(20.0)
    costs.set_time(90.0)
    assert not is_marked(costs)
    assert 0 < max(sizes) < 60 * 60
