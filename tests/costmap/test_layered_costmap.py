"""Tests marking, clearing, moving and unknown space of layered costmaps."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.costs import FREE, INSCRIBED, LETHAL, UNKNOWN
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

AHEAD = np.array([0.0])


def rolling_costmap(**changes):
    return LayeredCostmap(CostmapParams(**changes), disc(0.16), rolling=True)


def ray(metres):
    return np.array([metres], np.float64)


def test_a_return_marks_its_end_and_clears_the_beam():
    costs = rolling_costmap(inflation_radius=0.0)
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0))
    now = costs.update()
    assert now.at(1.01, 0.01) == LETHAL
    assert now.at(0.5, 0.01) == FREE
    assert now.at(1.5, 0.01) == UNKNOWN


def test_a_beam_without_return_clears_an_obsolete_mark():
    costs = rolling_costmap()
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0))
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(np.inf))
    assert costs.update().at(1.01, 0.01) == FREE


def test_a_sensor_never_clears_the_marks_of_another():
    costs = rolling_costmap()
    costs.mark_and_clear("camera", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0), (ray(0.0), ray(0.9)))
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(np.inf))
    assert costs.update().at(1.01, 0.01) == LETHAL
    costs.mark_and_clear("camera", SE2(0.0, 0.0, 0.0), AHEAD, ray(np.nan), (ray(0.0), ray(1.5)))
    assert costs.update().at(1.01, 0.01) == FREE


def test_beams_may_clear_another_layer_that_they_do_not_mark():
    costs = rolling_costmap(inflation_radius=0.0)
    for y in (0.01, 0.41):
        costs.mark_and_clear("camera", SE2(0.0, y, 0.0), AHEAD, ray(1.0), (ray(0.0), ray(0.9)))
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.5), also_clear="camera")
    costs.clear_around(SE2(1.5, 0.0, 0.0), 0.2, "lidar")
    now = costs.update()
    assert now.at(1.01, 0.01) == FREE
    assert now.at(1.01, 0.41) == LETHAL
    assert now.at(1.51, 0.01) == UNKNOWN


def test_clearing_does_not_create_a_missing_layer():
    costs = rolling_costmap()
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0), also_clear="camera")
    alone = rolling_costmap()
    alone.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0))
    np.testing.assert_array_equal(costs.update().cells, alone.update().cells)


@pytest.mark.parametrize("clear_to", [0.5, np.nan, -1.0, np.inf])
def test_an_obstacle_scan_clears_only_its_clear_interval(clear_to):
    costs = rolling_costmap()
    costs.mark_and_clear("camera", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0), (ray(0.0), ray(0.5)))
    costs.mark_and_clear("camera", SE2(0.0, 0.0, 0.0), AHEAD, ray(np.inf), (ray(0.0), ray(clear_to)))
    assert costs.update().at(1.01, 0.01) == LETHAL


@pytest.mark.parametrize("nothing", [np.nan, 0.0, -1.0])
def test_invalid_ranges_are_ignored(nothing):
    costs = rolling_costmap()
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(nothing))
    assert (costs.update().cells == UNKNOWN).all()


@settings(max_examples=40)
@given(st.lists(st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)), min_size=1, max_size=6))
def test_obstacles_stay_in_place_when_the_window_moves(moves):
    costs = rolling_costmap()
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0))
    for x, y in moves:
        costs.move_to(x, y)
    now = costs.update()
    assert now.at(1.01, 0.01) == LETHAL
    assert abs(now.origin_x + 2.0 - moves[-1][0]) <= 0.051


def test_cells_that_leave_the_window_are_cleared():
    costs = rolling_costmap()
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0))
    costs.move_to(50.0, 0.0)
    costs.move_to(0.0, 0.0)
    assert (costs.update().cells == UNKNOWN).all()


def grid(h, w, x=0.0, y=0.0):
    cells = np.zeros((h, w), np.int8)
    cells[:, 0] = 100
    cells[0, -1] = -1
    return Grid(cells, 0.05, x, y)


def test_obstacles_stay_in_place_when_the_map_grows():
    costs = LayeredCostmap(CostmapParams(), disc(0.16))
    costs.set_static(grid(40, 40))
    costs.mark_and_clear("lidar", SE2(1.0, 1.0, 0.0), AHEAD, ray(0.5))
    costs.set_static(grid(80, 90, -1.0, -0.5))
    now = costs.update()
    assert now.at(1.51, 1.01) == LETHAL
    assert now.at(-0.99, 1.0) == LETHAL
    assert now.cells[0, -1] == UNKNOWN


def test_walls_of_the_static_map_are_not_cleared():
    costs = LayeredCostmap(CostmapParams(), disc(0.16))
    costs.set_static(grid(40, 40))
    costs.mark_and_clear("lidar", SE2(1.0, 1.0, np.pi), AHEAD, ray(np.inf))
    assert costs.update().at(0.01, 1.0) == LETHAL


def test_recoveries_clear_the_costmap_around_the_robot() -> None:
    costs = rolling_costmap(inflation_radius=0.0, track_unknown=False)
    costs.mark_and_clear("lidar", SE2(0.01, 0.01, 0.0), np.array([0.0, np.pi / 2]), np.array([0.42, 1.52]))
    costs.clear_around(SE2(0.0, 0.0, 0.0), 0.8)
    now = costs.update()
    assert (now.at(0.42, 0.01), now.at(0.01, 1.52)) == (FREE, LETHAL)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.sampled_from([0.02, 0.05, 0.5]))
def test_marks_are_cleared_in_cells_under_the_robot_only(x: float, y: float, resolution: float) -> None:
    costs = rolling_costmap(inflation_radius=0.0, track_unknown=False, resolution=resolution)
    layer = costs.source_cells("camera")
    layer[:] = LETHAL
    costs.clear_footprint(SE2(x, y, 0.0))
    corner_x = costs.origin_x + np.arange(layer.shape[1] + 1) * resolution - x
    corner_y = costs.origin_y + np.arange(layer.shape[0] + 1) * resolution - y
    far_x, far_y = (np.maximum(np.abs(at[1:]), np.abs(at[:-1])) for at in (corner_x, corner_y))
    covered = np.hypot(far_x[None, :], far_y[:, None]) <= 0.16
    assert (layer[~covered] == LETHAL).all()
    centre = np.hypot(far_x[None, :] - resolution / 2, far_y[:, None] - resolution / 2)
    assert (layer[centre <= 0.16 - resolution] == UNKNOWN).all()


def test_cells_within_the_robot_radius_are_inscribed():
    costs = rolling_costmap()
    costs.mark_and_clear("lidar", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.01))
    now = costs.update()
    for x in np.arange(0.5, 1.5, 0.01):
        touches = max(abs(x - 1.025) - 0.025, 0.0) < 0.16
        assert not touches or now.at(x, 0.01) >= INSCRIBED


def test_floor_nearer_than_the_camera_range_is_not_cleared():
    costs = rolling_costmap()
    costs.mark_and_clear("camera", SE2(0.0, 0.0, 0.0), AHEAD, ray(0.4), (ray(0.0), ray(0.3)))
    costs.mark_and_clear("camera", SE2(0.0, 0.0, 0.0), AHEAD, ray(np.nan), (ray(0.6), ray(1.5)))
    assert costs.update().at(0.41, 0.01) == LETHAL


RADIUS = 0.16


def half_known_map(openings: Sequence[tuple[int, int]]) -> Grid:
    """Return a free map of 2 m x 2 m whose right half and some cells of the left half are unknown."""
    cells = np.zeros((40, 40), np.int8)
    cells[:, 20:] = -1
    for row, column in openings:
        cells[row, column] = -1
    return Grid(cells, 0.05, 0.0, 0.0)


def costs_of(grid: Grid, *, avoid_unknown: bool):
    costs = LayeredCostmap(CostmapParams(), disc(RADIUS), avoid_unknown=avoid_unknown)
    costs.set_static(grid)
    return costs.update()


@given(st.lists(st.tuples(st.integers(0, 39), st.integers(0, 39)), max_size=12))
def test_avoid_unknown_keeps_the_footprint_out_of_unknown_cells(openings):
    grid = half_known_map(openings)
    crossing, avoiding = costs_of(grid, avoid_unknown=False).cells, costs_of(grid, avoid_unknown=True).cells
    away = (
        19.5 + 0.5 - np.arange(20)
    ) * grid.resolution  # distances of the centres of the left half's columns
    assert (avoiding[:, :20][:, away <= RADIUS] >= INSCRIBED).all()
    assert (avoiding >= crossing).all()
    assert ((avoiding == UNKNOWN) == (crossing == UNKNOWN)).all()


def test_a_gap_between_beams_is_not_unknown_space():
    grid = half_known_map([(20, 5), (20, 6), (21, 5)])
    assert costs_of(grid, avoid_unknown=True).at(0.425, 1.025) == FREE


def test_unknown_cells_seen_later_may_be_crossed():
    costs = LayeredCostmap(CostmapParams(), disc(RADIUS), avoid_unknown=True)
    costs.set_static(half_known_map([]))
    for angle in np.linspace(-0.6, 0.6, 200):
        costs.mark_and_clear("camera", SE2(0.1, 1.0, angle), AHEAD, ray(np.inf))
    assert costs.update().at(1.1, 1.0) == FREE


@pytest.mark.parametrize("odd", [-np.inf, np.inf, np.nan, -1e300, 1e300])
def test_non_finite_clear_intervals_are_not_obstacles(odd: float) -> None:
    """The message type has no bounds for these values."""
    for near, far in ((odd, 1.0), (0.5, odd), (odd, odd)):
        costs = LayeredCostmap(CostmapParams(), disc(0.2), rolling=True)
        costs.move_to(0.0, 0.0)
        costs.update()
        angles, ranges = np.linspace(-0.5, 0.5, 8), np.full(8, np.inf)
        costs.mark_and_clear(
            "camera", SE2(0.0, 0.0, 0.0), angles, ranges, (np.full(8, near), np.full(8, far))
        )
        assert (costs.update().cells != LETHAL).all()


def test_a_mark_that_nothing_confirms_decays() -> None:
    costs = rolling_costmap(decay_time=60.0, track_unknown=False)
    for seconds in (0.0, 50.0):
        costs.set_time(seconds)
        costs.mark_and_clear("camera", SE2(0.0, 0.0, 0.0), AHEAD, ray(1.0))
    costs.set_time(109.0)
    costs.move_to(0.3, 0.2)  # the times move with the cells
    assert costs.update().at(1.01, 0.01) == LETHAL
    costs.set_time(111.0)
    assert costs.update().at(1.01, 0.01) == FREE
