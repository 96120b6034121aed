"""Paths with one-way lanes: never against one, and as cheap as a search of the directed graph finds them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.lanes import NO_LANES, OneWayLanes
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner, path_length
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import PlanningError, PlanningFailure

SIDE = 24
STEPS = [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)]


def random_costmap(seed: int) -> Costmap:
    """Return costs with some obstacles, and up to three lanes of any direction, which do not overlap."""
    rng = np.random.default_rng(seed)
    cells = rng.integers(0, 120, (SIDE, SIDE)).astype(np.uint8)
    cells[rng.random((SIDE, SIDE)) < 0.15] = LETHAL
    number, yaws = np.zeros((SIDE, SIDE), np.uint8), rng.uniform(-math.pi, math.pi, 3)
    for i in range(3):
        r, c = rng.integers(0, SIDE - 4, 2)
        window = number[r : r + rng.integers(2, 12), c : c + rng.integers(2, 12)]
        window[window == 0] = i + 1
    if seed % 3 == 0:
        yaws = np.round(yaws / (math.pi / 4.0)) * math.pi / 4.0
    directions = np.vstack([np.zeros((1, 2)), np.column_stack([np.cos(yaws), np.sin(yaws)])])
    return Costmap(cells, 0.1, -1.0, 2.0, lanes=OneWayLanes(number, directions, ("a", "b", "c")))


def reference(costmap: Costmap, weight: np.ndarray, source: int) -> np.ndarray:
    """Return the cost-to-come (h, w) in metres of a search of the directed graph by scipy."""
    weights, lanes, edges = weight[costmap.cells], costmap.lanes, []
    for r in range(SIDE):
        for c in range(SIDE):
            for dr, dc in STEPS:
                n, m = r + dr, c + dc
                if not (0 <= n < SIDE and 0 <= m < SIDE) or min(weights[r, c], weights[n, m]) == 0.0:
                    continue
                along = [lanes.directions[lanes.number[cell]] @ (dc, dr) for cell in ((r, c), (n, m))]
                if min(along) < -1e-6 or min(weights[r, m], weights[n, c]) == 0.0:
                    continue
                cost = math.hypot(dr, dc) * (weights[r, c] + weights[n, m]) / 2.0
                edges.append((r * SIDE + c, n * SIDE + m, cost))
    a, b, cost = np.array(edges).T
    graph = csr_matrix((cost, (a.astype(int), b.astype(int))), (SIDE * SIDE, SIDE * SIDE))
    lengths: np.ndarray = dijkstra(graph, indices=source).reshape(SIDE, SIDE) * costmap.resolution
    return lengths


@settings(max_examples=25)
@given(st.integers(0, 10_000))
@pytest.mark.slow
def test_the_potential_is_that_of_the_directed_graph(seed: int) -> None:
    costmap, planner = random_costmap(seed), GridPlanner()
    rows, columns = np.nonzero(costmap.cells < LETHAL)
    start = SE2(*costmap.centre(int(rows[0]), int(columns[0])), 0.0)
    potential = planner.potential(costmap, start)
    expected = reference(costmap, planner._weight, int(rows[0] * SIDE + columns[0]))
    assert np.array_equal(np.isfinite(potential), np.isfinite(expected))
    reached = np.isfinite(expected)
    assert potential[reached] == pytest.approx(expected[reached], rel=1e-4)


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.booleans())
def test_no_step_of_a_path_leads_against_a_lane(seed: int, smooth: bool) -> None:
    costmap = random_costmap(seed)
    rng = np.random.default_rng(seed + 1)
    rows, columns = np.nonzero(costmap.cells < LETHAL)
    a, b = rng.integers(0, len(rows), 2)
    start, goal = (SE2(*costmap.centre(int(rows[i]), int(columns[i])), 0.0) for i in (a, b))
    try:
        path = GridPlanner(PlannerParams(smooth=smooth, tolerance=0.0)).plan(costmap, start, goal)
    except PlanningError:
        return
    points = [path[0, :2]]
    for p, q in zip(
        path[:-1, :2], path[1:, :2], strict=True
    ):  # in between, too, but not on a corner of four cells
        points += [p + f * (q - p) for f in np.linspace(0.02, 0.98, 24)] + [q]
    samples = np.array(points)
    at = (samples - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
    lane = costmap.lanes.number[np.floor(at[:-1, 1]).astype(int), np.floor(at[:-1, 0]).astype(int)]
    along = (costmap.lanes.directions[lane] * np.diff(samples, axis=0)).sum(axis=1)
    assert along.min() >= -1e-6


def corridors(direction: float) -> Costmap:
    """Return two corridors between two rooms, the shorter one a one-way lane."""
    cells = np.zeros((40, 60), np.uint8)
    cells[12:35, 15:45] = LETHAL
    number = np.zeros(cells.shape, np.uint8)
    number[:12, 20:40] = 1
    directions = np.array([[0.0, 0.0], [math.cos(direction), math.sin(direction)]])
    return Costmap(cells, 0.1, 0.0, 0.0, lanes=OneWayLanes(number, directions, ("lane",)))


WEST, EAST = SE2(0.55, 1.05, 0.0), SE2(5.45, 1.05, 0.0)


def test_a_lane_is_taken_one_way_and_gone_round_the_other() -> None:
    planner = GridPlanner()
    for direction, there, back in ((0.0, WEST, EAST), (math.pi, EAST, WEST)):
        costmap = corridors(direction)
        assert path_length(planner.plan(costmap, there, back)) < 5.5
        assert planner.plan(costmap, back, there)[:, 1].max() > 3.4


def test_a_start_in_a_lane_leaves_it_forward() -> None:
    path = GridPlanner().plan(corridors(math.pi), SE2(3.0, 0.5, 0.0), EAST)
    assert (np.diff(path[:10, 0]) <= 1e-9).all() and path[:, 1].max() > 3.4


def test_without_another_way_there_is_none() -> None:
    costmap = corridors(math.pi)
    costmap.cells[35:, 30] = LETHAL
    with pytest.raises(PlanningError) as error:
        GridPlanner().plan(costmap, WEST, EAST)
    assert error.value.failure is PlanningFailure.NO_VALID_PATH
    assert len(GridPlanner().plan(costmap, EAST, WEST))


def test_a_planner_forgets_the_lanes_of_the_last_costmap() -> None:
    planner, with_lane = GridPlanner(), corridors(math.pi)
    planner.plan(with_lane, WEST, EAST)
    free = Costmap(with_lane.cells, 0.1, 0.0, 0.0)
    assert free.lanes is NO_LANES
    assert np.array_equal(planner.plan(free, WEST, EAST), GridPlanner().plan(free, WEST, EAST))
