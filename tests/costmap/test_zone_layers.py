"""Layers of the zones of the map: their cells against shapely, and when they are drawn again."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from chefbot.costmap.layer import CellMark, CostmapLayer, LayerSettings
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.layers import StaticLayer
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.zone_layers import OTHER_COST, KeepOutLayer, OneWayLayer, PreferredLayer, ZoneLayer
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, UNKNOWN
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.lanes import NO_LANES
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, PREFERRED, SLOW_ZONE, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.std_msgs import String

CELL, SHAPE = 0.1, (20, 25)
SETTINGS = LayerSettings(CostmapParams())
SQUARE = ((0.5, 0.5), (1.0, 0.5), (1.0, 1.0), (0.5, 1.0))


def costmap(*kinds: type[ZoneLayer], occupancy: int = 0) -> LayeredCostmap:
    """Return the costs of a map of one occupancy with layers of zones, from (0, 0) on."""
    layers: list[CostmapLayer] = [StaticLayer(SETTINGS), *(kind(SETTINGS) for kind in kinds)]
    costs = LayeredCostmap(CostmapParams(), disc(0.2), layers=layers)
    costs.set_static(Grid(np.full(SHAPE, occupancy, np.int8), CELL, 0.0, 0.0))
    return costs


def zone(name: str, kind: str, corners: Any = SQUARE, direction: float = 0.0) -> MapZone:
    return MapZone(name, kind, tuple(Point(x, y) for x, y in corners), 0.0, direction)


def set_zones(costs: LayeredCostmap, *zones: MapZone, frame: SE2 = IDENTITY) -> MapZones:
    message = MapZones(zones=zones)
    costs.process(message, frame)
    return message


POLYGONS = st.lists(st.floats(0.05, 0.9), min_size=3, max_size=7).map(
    lambda radii: [
        (1.2 + r * math.cos(k * 2 * math.pi / len(radii)), 1.0 + r * math.sin(k * 2 * math.pi / len(radii)))
        for k, r in enumerate(radii)
    ]
)
FRAMES = st.builds(SE2, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3.0, 3.0))


@settings(max_examples=15)
@given(POLYGONS, FRAMES)
def test_keep_out_cells_are_those_that_the_zone_touches(
    corners: list[tuple[float, float]], frame: SE2
) -> None:
    costs = costmap(KeepOutLayer)
    set_zones(costs, zone("stairs", KEEP_OUT, corners), frame=frame)
    cells, shape = costs.update().cells, Polygon(frame.apply(np.array(corners)))
    for row, column in np.ndindex(SHAPE):
        square = box(column * CELL, row * CELL, (column + 1) * CELL, (row + 1) * CELL)
        common = shape.intersection(square).area / CELL**2
        if common > 0.15:  # a corner of a cell may be missed
            assert cells[row, column] == LETHAL
        elif shape.distance(square) > 1e-9:
            assert cells[row, column] == FREE


@settings(max_examples=15)
@given(POLYGONS, FRAMES)
def test_only_inside_preferred_zones_the_cost_stays(corners: list[tuple[float, float]], frame: SE2) -> None:
    costs = costmap(PreferredLayer)
    set_zones(costs, zone("hall", PREFERRED, corners), frame=frame)
    cells, shape = costs.update().cells, Polygon(frame.apply(np.array(corners)))
    for row, column in np.ndindex(SHAPE):
        middle = shapely.Point((column + 0.5) * CELL, (row + 0.5) * CELL)
        if shape.boundary.distance(middle) > 1e-6:
            assert cells[row, column] == (FREE if shape.contains(middle) else OTHER_COST)


def test_no_preferred_zone_makes_anything_cheaper() -> None:
    for occupancy, cost in ((100, LETHAL), (-1, UNKNOWN)):
        costs = costmap(PreferredLayer, occupancy=occupancy)
        set_zones(costs, zone("hall", PREFERRED))
        assert (costs.update().cells == cost).all(), "an obstacle and unknown space stay what they are"


def test_each_layer_takes_the_zones_of_its_kind() -> None:
    kinds = {KEEP_OUT: KeepOutLayer, PREFERRED: PreferredLayer, ONE_WAY: OneWayLayer}
    for zone_kind in (KEEP_OUT, PREFERRED, ONE_WAY, SLOW_ZONE, "of an owner"):
        for kind, layer in kinds.items():
            costs = costmap(layer)
            set_zones(costs, zone("a", zone_kind))
            result = costs.update()
            assert (result.cells.any() or result.lanes is not NO_LANES) == (zone_kind == kind)


def test_a_cell_of_two_keep_out_zones_names_the_later_one() -> None:
    costs = costmap(KeepOutLayer)
    right = [(x + 0.3, y) for x, y in SQUARE]
    set_zones(costs, zone("left", KEEP_OUT), zone("right", KEEP_OUT, right))
    costs.update()
    named = [costs.marked_by(x, 0.75) for x in (0.55, 0.95, 1.25, 1.45)]
    assert named == [CellMark(f"keep-out zone {name}", 0.0) for name in ("left", "right", "right")] + [None]


def test_before_it_is_drawn_a_zone_has_no_cells_to_name() -> None:
    costs = costmap(KeepOutLayer)
    set_zones(costs, zone("stairs", KEEP_OUT))
    assert costs.marked_by(0.75, 0.75) is None
    costs.update()
    assert costs.marked_by(0.75, 0.75) is not None
    costs.set_static(Grid(np.zeros((30, 30), np.int8), CELL, -1.0, -1.0))
    assert costs.marked_by(0.75, 0.75) is None, "the map has changed"
    assert costs.update().at(0.75, 0.75) == LETHAL and costs.marked_by(0.75, 0.75) is not None


@pytest.mark.parametrize(
    ("frame", "again"),
    [
        (SE2(0.024, 0.0, 0.0), False),
        (SE2(0.026, 0.0, 0.0), True),
        (SE2(0.0, -0.026, 0.0), True),
        (SE2(0.018, 0.018, 0.0), True),
        (SE2(0.0, 0.0, 0.007), False),
        (SE2(0.0, 0.0, 0.0085), True),  # the farthest corner moves by 27 mm
        (SE2(0.0, 0.0, -0.03), True),
    ],
)
def test_zones_are_drawn_again_when_they_moved_by_a_quarter_cell(frame: SE2, again: bool) -> None:
    drawn: list[Any] = []

    class Recorded(KeepOutLayer):
        def draw(self, costs: LayeredCostmap, polygons: list[Any]) -> None:
            drawn.append(polygons)
            super().draw(costs, polygons)

    costs = costmap(Recorded)
    message = set_zones(costs, zone("stairs", KEEP_OUT))
    costs.update()
    costs.process(message, frame)
    costs.update()
    costs.process(String("nothing about zones"), frame)
    costs.update()
    assert len(drawn) == 1 + again


def test_small_motions_of_the_frame_add_up() -> None:
    costs = costmap(KeepOutLayer)
    message = set_zones(costs, zone("stairs", KEEP_OUT))
    costs.update()
    for k in range(1, 31):
        costs.process(message, SE2(0.01 * k, 0.0, 0.0))
    cells = costs.update().cells
    assert cells[7, 12] == LETHAL and cells[7, 5] == FREE


def test_zones_that_are_withdrawn_leave_no_cost_and_no_lane() -> None:
    costs = costmap(KeepOutLayer, PreferredLayer, OneWayLayer)
    set_zones(costs, *(zone(kind, kind) for kind in (KEEP_OUT, PREFERRED, ONE_WAY)))
    assert costs.update().cells.any() and costs.update().lanes.names == ("one-way lane one way",)
    set_zones(costs)
    assert not costs.update().cells.any() and costs.update().lanes is NO_LANES


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_a_lane_turns_with_its_frame(direction: float, yaw: float) -> None:
    costs = costmap(OneWayLayer)
    frame = SE2(1.2, 1.0, yaw)
    centred = [(x - 0.75, y - 0.75) for x, y in SQUARE]
    set_zones(costs, zone("out", ONE_WAY, centred, direction), frame=frame)
    lanes = costs.update().lanes
    assert lanes.names == ("one-way lane out",) and lanes.number[10, 12] == 1 and lanes.number[0, 0] == 0
    assert lanes.directions[0].tolist() == [0.0, 0.0]
    assert lanes.directions[1] == pytest.approx([math.cos(direction + yaw), math.sin(direction + yaw)])


def test_lanes_do_not_change_costs() -> None:
    costs = costmap(OneWayLayer)
    before = costs.update().cells.copy()
    set_zones(costs, zone("out", ONE_WAY), zone("in", ONE_WAY, [(x + 0.6, y) for x, y in SQUARE], math.pi))
    result = costs.update()
    assert np.array_equal(result.cells, before) and set(np.unique(result.lanes.number)) == {0, 1, 2}
    assert INSCRIBED > OTHER_COST > FREE
