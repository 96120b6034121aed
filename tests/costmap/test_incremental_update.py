"""Tests that incremental updates of a layered costmap are bit-identical to full updates."""

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.costmap.inflation import inflate
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.update_window import EMPTY_WINDOW, CellWindow
from chefbot.maths.costs import Costmap
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

ANGLES = np.linspace(-math.pi, math.pi, 25)
PARAMS = CostmapParams(resolution=0.1, size=3.0, marking_range=1.2, clearing_range=1.5)
RADIUS = 0.2


def ranges_of(seed: int) -> np.ndarray:
    """Return random ranges, some of which are inf, NaN, 0 or beyond the marking range."""
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.1, 2.0, ANGLES.size)
    ranges[rng.random(ANGLES.size) < 0.2] = rng.choice([math.inf, math.nan, 0.0])
    return ranges


def static_of(seed: int) -> Grid:
    """Return a random map of up to 4 m with unknown regions."""
    rng = np.random.default_rng(seed)
    cells = np.zeros(rng.integers(5, 40, 2), np.int8)
    for value in (100, -1, -1):
        r, c = rng.integers(0, cells.shape)
        cells[r : r + rng.integers(1, 12), c : c + rng.integers(1, 12)] = value
    return Grid(cells, 0.1, *(0.1 * rng.integers(-10, 3, 2)))


def random_pose(rng: np.random.Generator) -> SE2:
    """Return a random pose on the map or up to half a metre outside it."""
    return SE2(*rng.uniform(-0.5, 2.5, 2), rng.uniform(-3.0, 3.0))


def apply_random_change(costs: LayeredCostmap, seed: int) -> None:
    """Call one of the methods that change a costmap, most often with a scan."""
    rng = np.random.default_rng(seed)
    kind, pose = rng.choice(9, p=(0.35, 0.15, 0.15, 0.02, 0.06, 0.06, 0.06, 0.05, 0.1)), random_pose(rng)
    source = ("laser", "camera")[seed % 2]
    if kind == 0:
        costs.mark_and_clear(source, pose, ANGLES, ranges_of(seed))
    elif kind == 1:
        floor = ranges_of(seed + 1) * 0.3, ranges_of(seed + 2)
        costs.mark_and_clear("camera", pose, ANGLES, ranges_of(seed), floor)
    elif kind == 2:
        costs.clear_around(pose, rng.uniform(0.0, 1.5), (source, None)[seed // 2 % 2])
    elif kind == 3:
        costs.clear()
    elif kind in (4, 5) and costs.rolling:
        costs.move_to(pose.x, pose.y)
    elif kind == 4:
        costs.set_static(static_of(seed))
    elif kind == 6:
        costs.reconfigure(msgspec.structs.replace(costs.params, inflation_radius=rng.uniform(0.1, 1.0)))
    elif kind == 7:
        costs.mark_and_clear("laser", pose, ANGLES, ranges_of(seed), also_clear="camera")
    elif kind == 8:
        costs.clear_footprint(pose)


def full_update(costs: LayeredCostmap) -> Costmap:
    """Update all cells."""
    costs._combined = None
    return costs.update()


@settings(max_examples=25)
@given(st.integers(0, 2**20), st.booleans(), st.booleans(), st.booleans())
def test_incremental_update_equals_a_full_update(seed: int, rolling: bool, avoid: bool, track: bool) -> None:
    params = msgspec.structs.replace(PARAMS, track_unknown=track)
    costs, whole = (
        LayeredCostmap(params, disc(RADIUS), rolling=rolling, avoid_unknown=avoid) for _ in range(2)
    )
    if not rolling:
        costs.set_static(static_of(seed))
        whole.set_static(static_of(seed))
    for step in range(seed, seed + 30):
        apply_random_change(costs, step)
        apply_random_change(whole, step)
        if step % 3:
            np.testing.assert_array_equal(costs.update().cells, full_update(whole).cells)


def test_an_update_copies_no_map() -> None:
    costs = LayeredCostmap(PARAMS, disc(RADIUS))
    costs.set_static(static_of(1))
    before = costs.update().cells
    kept = before.copy()
    costs.mark_and_clear("laser", SE2(0.5, 0.5, 0.0), ANGLES, np.full(ANGLES.size, 0.5))
    assert costs.update().cells is before and not np.array_equal(before, kept)


def test_one_scan_inflates_only_its_surroundings(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []

    def record_size(cells: np.ndarray, table: np.ndarray) -> np.ndarray:
        sizes.append(cells.size)
        return inflate(cells, table)

    costs = LayeredCostmap(PARAMS, disc(RADIUS))
    costs.set_static(Grid(np.zeros((500, 500), np.int8), 0.1, 0.0, 0.0))
    costs.update()
    monkeypatch.setattr("chefbot.costmap.layers.inflate", record_size)
    costs.update()
    assert sizes == [], "nothing has changed"
    costs.mark_and_clear("laser", SE2(25.0, 25.0, 0.0), ANGLES, np.full(ANGLES.size, 1.0))
    costs.update()
    assert (
        sum(sizes) <= (2 * (10 + 2 * 6 + 3)) ** 2
    )  # cells: marking range, twice the inflation radius, rounding


def test_update_windows_merge_and_stay_within_the_grid() -> None:
    a, b = CellWindow(1, 2, 3, 4), CellWindow(10, 0, 12, 3)
    assert a.union(b) == b.union(a) == CellWindow(1, 0, 12, 4)
    assert a.union(EMPTY_WINDOW) == EMPTY_WINDOW.union(a) == a
    assert a.expanded(5, (6, 6)) == CellWindow(0, 0, 6, 6)
    assert CellWindow.around(50.0, 50.0, 2.0).expanded(0, (9, 9)).empty
