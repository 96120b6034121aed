"""Costs with narrow passages open: what the body fits through is open, what it does not is closed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.costmap.glass_layer import GlassLayer
from chefbot.costmap.layer import LayerSettings
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.layers import built_in_layers
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.sources import PERMANENT_SOURCES
from chefbot.maths.costs import INSCRIBED, LETHAL
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

RADIUS = 0.15
HALF_CELL = 0.025
NOBODY = np.empty((0, 2))


def wall_with_gap(width: float, offset: float) -> LayeredCostmap:
    """Return the costs of a wall along x at y = 0, whose gap begins at x = offset, m; cells that it touches."""
    cells = np.zeros((60, 80), np.int8)
    edges = -2.0 + 0.05 * np.arange(81)
    touched = (edges[:-1] < offset) | (edges[1:] > offset + width)
    cells[29:31, touched] = 100
    settings = LayerSettings(CostmapParams())
    static, *others = built_in_layers(settings)
    layers = [static, GlassLayer(settings), *others]
    costs = LayeredCostmap(CostmapParams(), disc(RADIUS), layers=layers)
    costs.set_static(Grid(cells, 0.05, -2.0, -1.5))
    return costs


def is_open(cells: np.ndarray) -> bool:
    """Return whether the robot's centre can be in some cell of the wall's rows."""
    return bool((cells[29:31] < INSCRIBED).all(axis=0).any())


@given(st.floats(-0.5, 0.5))
def test_a_gap_of_the_body_and_ten_centimetres_is_open(offset: float) -> None:
    costs = wall_with_gap(2.0 * RADIUS + 0.1, offset)
    assert is_open(costs.narrow_costs(-HALF_CELL, NOBODY, 0.5).cells)
    assert not is_open(costs.update().cells)


@given(st.floats(-0.5, 0.5))
def test_a_gap_that_is_smaller_than_the_body_is_closed(offset: float) -> None:
    assert not is_open(wall_with_gap(2.0 * RADIUS - 0.1, offset).narrow_costs(-HALF_CELL, NOBODY, 0.5).cells)


def test_beside_people_nothing_is_opened() -> None:
    costs = wall_with_gap(0.45, 0.0)
    beside = costs.narrow_costs(-HALF_CELL, np.array([[0.3, 0.4]]), 0.6)
    assert not is_open(beside.cells)
    assert is_open(costs.narrow_costs(-HALF_CELL, np.array([[1.5, 0.4]]), 0.6).cells)


def test_the_usual_costs_stay_as_they_were() -> None:
    costs = wall_with_gap(0.45, 0.0)
    before = costs.update().cells.copy()
    costs.narrow_costs(-HALF_CELL, NOBODY, 0.5)
    assert np.array_equal(costs.update().cells, before)


def test_marks_of_sensors_count_only_where_wanted() -> None:
    costs = wall_with_gap(0.45, 0.0)
    costs.mark_and_clear("laser", SE2(0.225, -1.0, np.pi / 2), np.array([0.0]), np.array([1.0]))
    assert not is_open(costs.narrow_costs(-HALF_CELL, NOBODY, 0.5).cells)
    wall = np.zeros(costs.shape, np.bool_)
    assert is_open(costs.narrow_costs(-HALF_CELL, NOBODY, 0.5, wall).cells)
    assert not is_open(costs.narrow_costs(-HALF_CELL, NOBODY, 0.5, ~wall).cells)


@pytest.mark.parametrize("source", PERMANENT_SOURCES)
def test_marks_of_glass_and_drop_offs_count_everywhere(source: str) -> None:
    costs = wall_with_gap(0.45, 0.0)
    nowhere = np.zeros(costs.shape, np.bool_)
    assert is_open(costs.narrow_costs(-HALF_CELL, NOBODY, 0.5, nowhere).cells)
    costs.source_cells(source)[29, 44] = LETHAL
    assert not is_open(costs.narrow_costs(-HALF_CELL, NOBODY, 0.5, nowhere).cells)


@pytest.mark.parametrize(
    ("source", "remains"), [*((one, True) for one in PERMANENT_SOURCES), ("laser", False)]
)
def test_only_what_is_as_permanent_as_a_wall_remains_far_away(source: str, remains: bool) -> None:
    costs = wall_with_gap(1.0, 0.0)
    empty = costs.permanent_cells()
    costs.source_cells(source)[29, 50] = LETHAL
    far = SE2(100.0, 0.0, 0.0)
    for found in (costs.costs_without_marks(), costs.costs_without_far_marks([far])):
        assert bool(found.cells[29, 50] == LETHAL) is remains
    assert (costs.permanent_cells() != empty) is remains
