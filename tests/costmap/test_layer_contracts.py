"""What holds for every layer of a costmap, built in or not."""
# ruff: noqa: ARG002 (a layer with the interface of all)

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.costmap.layer import CellMark, CostmapLayer, LayerSettings
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.layers import InflationLayer, StaticLayer
from chefbot.costmap.params import LAYERS, LOCAL_COSTMAP, CostmapParams
from chefbot.costmap.update_window import CellWindow
from chefbot.maths.costs import LETHAL, UNKNOWN
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT, ONE_WAY, PREFERRED, SLOW_ZONE, MapZone, MapZones
from chefbot.msgs.geometry_msgs import Point, PoseStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.load import load_robot
from chefbot.runtime.plugins import load_plugin
from chefbot.scan.drop_offs import drop_range

ROBOT = load_robot("chefbot_lidar")
PARAMS = CostmapParams(resolution=0.1, size=3.0, marking_range=1.2, clearing_range=1.5, inflation_radius=0.4)
CUSTOM = "tests.costmap.test_layer_contracts:Stripe"
EVERY = (*LAYERS, CUSTOM)


class Stripe(CostmapLayer):
    """A layer of an owner: a lethal row."""

    def __init__(self, settings: LayerSettings) -> None:
        self._row = 5

    def update_costs(self, costs: LayeredCostmap, cells: NDArray[np.uint8], window: CellWindow) -> None:
        cells[max(self._row, window.top) : min(self._row + 1, window.bottom), window.left : window.right] = (
            LETHAL
        )

    def marks(self, costs: LayeredCostmap, row: int, column: int) -> list[CellMark]:
        return [CellMark("stripe", 0.0)] if row == self._row else []


def layers(names: tuple[str, ...], params: CostmapParams = PARAMS) -> list[CostmapLayer]:
    given = LayerSettings(params, ROBOT, drop_range(ROBOT))
    return [load_plugin(name, StaticLayer, given, CostmapLayer) for name in names]


def costmap(names: tuple[str, ...] = EVERY, *, rolling: bool = False) -> LayeredCostmap:
    costs = LayeredCostmap(PARAMS, disc(0.2), rolling=rolling, layers=layers(names))
    costs.process(grid_message(1), IDENTITY)
    return costs


def grid_message(seed: int) -> OccupancyGrid:
    cells = np.where(np.random.default_rng(seed).random((34, 30)) < 0.02, 100, 0).astype(np.int8)
    cells[:4, :6] = -1
    return OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.1, -1.0, -1.5))


def zones(seed: int) -> MapZones:
    """Return triangles of all kinds."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice([KEEP_OUT, SLOW_ZONE, PREFERRED, ONE_WAY], rng.integers(0, 5))
    return MapZones(zones=tuple(triangle(str(i), str(kind), rng) for i, kind in enumerate(kinds)))


def triangle(name: str, kind: str, rng: np.random.Generator) -> MapZone:
    corners = rng.uniform(-1.0, 1.0, 2) + rng.uniform(-0.6, 0.6, (3, 2))
    return MapZone(name, kind, tuple(Point(x, y, 0.0) for x, y in corners.tolist()), 0.2, 1.0)


def scan(seed: int) -> LaserScan:
    ranges = np.random.default_rng(seed).uniform(0.1, 1.4, 60).astype(np.float32)
    return LaserScan(angle_min=-3.0, angle_increment=0.1, range_max=8.0, ranges=ranges)


def obstacles(seed: int) -> ObstacleScan:
    rng = np.random.default_rng(seed)
    names = ("ranges", "clear_from", "clear_to", "bottom", "top")
    arrays = [(rng.uniform(0.1, 1.3, 20)).astype(np.float32) for _ in names]
    return ObstacleScan(
        angle_min=-0.5, angle_increment=0.05, range_max=3.0, **dict(zip(names, arrays, strict=True))
    )


MESSAGES: tuple[Callable[[int], Message], ...] = (
    scan,
    obstacles,
    zones,
    grid_message,
    lambda seed: Range(field_of_view=0.3, min_range=0.02, max_range=4.0, range=0.3 + seed % 7 / 10.0),
    lambda _: PoseStamped(),
    lambda _: String("nothing that a layer knows"),
)


def frame(seed: int) -> SE2:
    rng = np.random.default_rng(seed)
    return SE2(*rng.uniform(-0.8, 0.8, 2), rng.uniform(-3.0, 3.0))


@settings(max_examples=25)
@given(st.lists(st.tuples(st.sampled_from(MESSAGES), st.integers(0, 10_000)), max_size=12), st.booleans())
def test_incremental_updates_equal_a_full_one(
    events: list[tuple[Callable[[int], Message], int]], rolling: bool
) -> None:
    costs, whole = costmap(rolling=rolling), costmap(rolling=rolling)
    for i, (make, seed) in enumerate(events):
        for one in (costs, whole):
            one.set_time(float(i))
            one.process(make(seed), frame(seed))
        whole.note_all_changed()
        a, b = costs.update(), whole.update()
        assert np.array_equal(a.cells, b.cells)
        assert np.array_equal(a.lanes.number, b.lanes.number)


@pytest.mark.parametrize("name", EVERY)
@given(st.integers(0, 10_000), st.integers(0, 20), st.integers(0, 20))
@settings(max_examples=10)
def test_a_layer_writes_only_the_window(name: str, seed: int, top: int, left: int) -> None:
    costs = costmap((name,))
    for make in MESSAGES:
        costs.process(make(seed), frame(seed))
    cells = np.random.default_rng(seed).choice(np.array([0, 90, LETHAL, UNKNOWN], np.uint8), costs.shape)
    before, window = cells.copy(), CellWindow(top, left, top + 7, left + 5)
    costs.layers[0].update_costs(costs, cells, window)
    outside = np.ones(costs.shape, np.bool_)
    outside[window.slices] = False
    assert np.array_equal(cells[outside], before[outside])


@given(st.integers(0, 10_000))
@settings(max_examples=15)
def test_every_lethal_cell_has_a_source(seed: int) -> None:
    costs = costmap()
    for make in MESSAGES:
        costs.process(make(seed), frame(seed))
    result = costs.update()
    for row, column in np.argwhere(result.cells == LETHAL).tolist():
        mark = costs.marked_by(*result.centre(row, column))
        assert mark is not None and mark.source


@pytest.mark.parametrize("name", EVERY)
def test_a_layer_stands_a_costmap_of_any_size(name: str) -> None:
    for size in ((1, 1), (2, 50), (40, 3)):
        costs = LayeredCostmap(PARAMS, disc(0.2), layers=layers((name,)))
        cells = np.zeros(size, np.int8)
        costs.process(OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.1, 0.0, 0.0)), IDENTITY)
        costs.process(zones(3), IDENTITY)
        if name == LAYERS[0]:
            assert costs.update().cells.shape == size


def test_an_owner_adds_a_layer_below_the_inflation() -> None:
    names = tuple(name for item in LAYERS for name in ((CUSTOM, item) if "Inflation" in item else (item,)))
    costs = costmap(names)
    cells = costs.update().cells
    assert (cells[5] == LETHAL).all() and (cells[6] >= 253).all()
    assert costs.marked_by(0.0, -1.5 + 0.55) == CellMark("stripe", 0.0)


def test_keep_out_zones_are_inflated_and_named() -> None:
    costs = costmap()
    square = tuple(Point(x, y, 0.0) for x, y in ((0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)))
    costs.process(MapZones(zones=(MapZone("stairs", KEEP_OUT, square),)), IDENTITY)
    result = costs.update()
    assert result.at(0.25, 0.25) == LETHAL and result.at(-0.15, 0.25) >= 253
    assert costs.marked_by(0.25, 0.25) == CellMark("keep-out zone stairs", 0.0)
    assert costs.static_costs().at(0.25, 0.25) < LETHAL
    costs.process(MapZones(), IDENTITY)
    assert costs.update().at(0.25, 0.25) < LETHAL


def test_zones_follow_localization_in_the_local_costmap() -> None:
    local = msgspec.structs.replace(LOCAL_COSTMAP, resolution=0.1, size=3.0)
    costs = LayeredCostmap(local, disc(0.2), rolling=True, layers=layers(local.layers, local))
    square = tuple(Point(x, y, 0.0) for x, y in ((1.0, 0.0), (1.4, 0.0), (1.4, 0.4), (1.0, 0.4)))
    message = MapZones(zones=(MapZone("stairs", KEEP_OUT, square),))
    costs.process(message, IDENTITY)
    assert costs.update().at(1.25, 0.25) == LETHAL
    costs.process(message, SE2(0.01, 0.0, 0.0))  # less than a quarter of a cell
    assert costs.update().at(1.25, 0.25) == LETHAL
    costs.process(message, SE2(-2.0, 0.0, 0.0))
    assert costs.update().at(1.25, 0.25) < LETHAL == costs.update().at(-0.75, 0.25)
    costs.process(message, SE2(0.0, 0.0, math.pi / 2.0))
    assert costs.update().at(-0.25, 1.25) == LETHAL


def test_space_outside_preferred_zones_costs_more() -> None:
    costs = LayeredCostmap(PARAMS, disc(0.2), layers=layers(LAYERS))
    cells = np.zeros((30, 30), np.int8)
    costs.process(OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.1, 0.0, 0.0)), IDENTITY)
    square = tuple(Point(x, y, 0.0) for x, y in ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)))
    costs.process(MapZones(zones=(MapZone("hall", PREFERRED, square),)), IDENTITY)
    result = costs.update()
    assert result.at(1.5, 1.5) == 0 < result.at(0.5, 0.5) < 253


def test_only_inflation_spreads() -> None:
    costs = costmap()
    spreading = [layer for layer in costs.layers if layer.reach(costs)]
    assert [type(layer) for layer in spreading] == [InflationLayer]
