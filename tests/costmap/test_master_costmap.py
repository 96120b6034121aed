"""The master costmap with layers that spread, in any order: its windows against a calculation of all cells."""
# ruff: noqa: ARG002 (layers with the interface of all)

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.costmap.layer import CostmapLayer
from chefbot.costmap.master_costmap import MasterCostmap
from chefbot.costmap.update_window import CellWindow
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, UNKNOWN

SHAPE = (13, 17)
Cells = NDArray[np.uint8]


class Paint(CostmapLayer):
    """Writes what its cells have, where they are not free."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.cells = rng.choice(np.array([FREE] * 9 + [40, LETHAL, UNKNOWN], np.uint8), SHAPE)

    def update_costs(self, costs: Any, cells: Cells, window: CellWindow) -> None:
        part = self.cells[window.slices]
        cells[window.slices] = np.where(part == FREE, cells[window.slices], part)


class Spread(CostmapLayer):
    """Raises each cell to the largest cost within some cells, less one for each of them."""

    def __init__(self, reach: int) -> None:
        self._reach = reach

    def reach(self, costs: Any) -> int:
        return self._reach

    def update_costs(self, costs: Any, cells: Cells, window: CellWindow) -> None:
        cells[window.slices] = spread(cells, self._reach)[window.slices]


def spread(cells: Cells, reach: int) -> Cells:
    """Return the costs after a layer with a reach."""
    known = np.where(cells == UNKNOWN, 0, cells).astype(int)
    padded = np.pad(known, reach)
    out = known.copy()
    for dr in range(-reach, reach + 1):
        for dc in range(-reach, reach + 1):
            part = padded[reach + dr :, reach + dc :][: cells.shape[0], : cells.shape[1]]
            out = np.maximum(out, part - abs(dr) - abs(dc))
    return np.where(cells == UNKNOWN, UNKNOWN, out).astype(np.uint8)


def expected(layers: list[Paint | Spread], track_unknown: bool) -> Cells:
    """Return the costs of all layers, each over the whole grid."""
    cells = np.full(SHAPE, UNKNOWN if track_unknown else FREE, np.uint8)
    for layer in layers:
        if isinstance(layer, Spread):
            cells = spread(cells, layer._reach)
        else:
            cells = np.where(layer.cells == FREE, cells, layer.cells)
    return cells


def costs_of(track_unknown: bool) -> Any:
    """Return what the master needs of a layered costmap."""
    return SimpleNamespace(shape=SHAPE, params=SimpleNamespace(track_unknown=track_unknown))


ORDERS = st.lists(
    st.one_of(st.builds(Paint, st.integers(0, 99)), st.builds(Spread, st.integers(1, 3))), max_size=5
)
CHANGES = st.lists(
    st.tuples(
        st.integers(-2, 12),
        st.integers(-2, 16),
        st.integers(1, 6),
        st.sampled_from([FREE, 70, LETHAL, UNKNOWN]),
    ),
    max_size=6,
)


@settings(max_examples=30)
@given(ORDERS, CHANGES, st.booleans())
def test_windows_give_the_costs_of_a_full_calculation(
    layers: list[Paint | Spread], changes: list[tuple[int, int, int, int]], track_unknown: bool
) -> None:
    costs = costs_of(track_unknown)
    master, painted = MasterCostmap(costs, layers, 0.0), [one for one in layers if isinstance(one, Paint)]
    master.update(costs)
    assert np.array_equal(master.costs, expected(layers, track_unknown))
    for i, (row, column, side, value) in enumerate(changes):
        if painted:
            painted[i % len(painted)].cells[max(row, 0) : row + side, max(column, 0) : column + side] = value
        master.touch(CellWindow(row, column, row + side, column + side))
        if i % 3 != 1:  # sometimes two changes between updates
            master.update(costs)
            assert np.array_equal(master.costs, expected(layers, track_unknown))


def test_nothing_is_calculated_where_nothing_changed() -> None:
    costs, layer, late = costs_of(True), Paint(1), Paint(2)
    master = MasterCostmap(costs, [layer, Spread(2), late], 0.0)
    master.update(costs)
    before = master.costs.copy()
    layer.cells[:], late.cells[:] = LETHAL, LETHAL
    master.update(costs)
    assert np.array_equal(master.costs, before)
    master.touch(CellWindow(6, 8, 7, 9))
    master.update(costs)
    changed = np.argwhere(master.costs != before)
    assert len(changed) and (np.abs(changed - (6, 8)) <= 2).all(), "within the reach of the one cell"


@settings(max_examples=10)
@given(st.integers(0, 999), CHANGES)
def test_the_margin_of_unknown_space_follows_what_is_seen(
    seed: int, changes: list[tuple[int, int, int, int]]
) -> None:
    """A cell within the radius of an unknown region as large as a disc of it costs at least INSCRIBED."""
    costs, layer = costs_of(True), Paint(seed)
    layer.cells[:] = np.where(layer.cells == FREE, 1, layer.cells)
    layer.cells[3:8, 2:7] = UNKNOWN
    master = MasterCostmap(costs, [layer, Spread(1)], 1.5)
    master.update(costs)
    for row, column, side, value in changes:
        layer.cells[max(row, 0) : row + side, max(column, 0) : column + side] = value or 1
        master.touch(CellWindow(row, column, row + side, column + side))
        master.update(costs)
    plain = expected([layer, Spread(1)], True)
    near = np.zeros(SHAPE, np.bool_)
    for region in unknown_regions(layer.cells):
        if len(region) >= np.pi * 1.5**2:
            for row, column in region:
                near[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] = True
    raised = near & (plain < INSCRIBED)
    assert np.array_equal(master.costs, np.where(raised, INSCRIBED, plain))


def unknown_regions(cells: Cells) -> list[set[tuple[int, int]]]:
    """Return the regions of unknown cells that touch each other by sides or corners."""
    left = {(row, column) for row, column in np.argwhere(cells == UNKNOWN).tolist()}
    regions = []
    while left:
        region, edge = set(), {left.pop()}
        while edge:
            region |= edge
            beside = {(r + dr, c + dc) for r, c in edge for dr in (-1, 0, 1) for dc in (-1, 0, 1)}
            edge = beside & left
            left -= edge
        regions.append(region)
    return regions
