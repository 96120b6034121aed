"""Tests the global planner against Dijkstra on the same graph, its smoothing, errors and replaced goals."""

import gzip
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner, cost_to_weight, path_length
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import PlanningError, PlanningFailure

maps = arrays(
    np.uint8,
    st.tuples(st.integers(2, 14), st.integers(2, 17)),
    elements=st.sampled_from([0] * 6 + [20, 90, 252, INSCRIBED, LETHAL, UNKNOWN]),
)
RAW = PlannerParams(smooth=False, tolerance=0.0, escape=0.0)


def reference(cells, params):
    """Return the cost between all pairs of cells by scipy's Dijkstra on the same graph."""
    weight = cost_to_weight(params)[cells].astype(float)
    h, w = cells.shape
    edges = []
    for r, c in np.ndindex(h, w):
        for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
            if not (r + dr < h and 0 <= c + dc < w):
                continue
            if min(weight[r, c], weight[r + dr, c + dc], weight[r, c + dc], weight[r + dr, c]) > 0:
                step = np.hypot(dr, dc) * (weight[r, c] + weight[r + dr, c + dc]) / 2
                edges.append((r * w + c, (r + dr) * w + c + dc, step))
    a, b, cost = np.array(edges).T if edges else np.zeros((3, 0))
    return dijkstra(coo_matrix((cost, (a.astype(int), b.astype(int))), shape=(h * w, h * w)), directed=False)


def chain_cost(path, cells, params):
    weight = cost_to_weight(params)[cells].astype(float)
    at = np.floor(path[:, :2]).astype(int)
    w = weight[at[:, 1], at[:, 0]]
    return float((np.hypot(*np.diff(at, axis=0).T) * (w[1:] + w[:-1]) / 2).sum())


@settings(max_examples=80)
@given(maps, st.data(), st.booleans())
def test_path_cost_equals_dijkstra_of_scipy(cells, data, unknown):
    params = PlannerParams(smooth=False, tolerance=0.0, escape=0.0, allow_unknown=unknown, spacing=0.01)
    free = np.argwhere(cost_to_weight(params)[cells] > 0)
    assume(len(free) >= 2)
    (r0, c0), (r1, c1) = (free[data.draw(st.integers(0, len(free) - 1))] for _ in range(2))
    truth = reference(cells, params)
    costmap, planner = Costmap(cells, 1.0, 0.0, 0.0), GridPlanner(params)
    start, goal = SE2(c0 + 0.5, r0 + 0.5, 0.0), SE2(c1 + 0.5, r1 + 0.5, 0.0)
    best = truth[r0 * cells.shape[1] + c0].reshape(cells.shape)
    potential = planner.potential(costmap, start)
    assert np.allclose(potential, best, rtol=1e-5)
    if np.isfinite(best[r1, c1]):
        planner.plan(costmap, start, goal)
        reached = planner._g.reshape(planner._padded.shape)[r1 + 1, c1 + 1]
        assert reached == pytest.approx(best[r1, c1], rel=1e-5)
    else:
        with pytest.raises(PlanningError) as error:
            planner.plan(costmap, start, goal)
        assert error.value.failure is PlanningFailure.NO_VALID_PATH


@settings(max_examples=80)
@given(maps, st.data())
def test_a_smoothed_path_never_touches_blocked_cells(cells, data):
    params = PlannerParams(tolerance=0.0, escape=0.0)
    free = np.argwhere(cells < INSCRIBED)
    assume(len(free) >= 2)
    (r0, c0), (r1, c1) = (free[data.draw(st.integers(0, len(free) - 1))] for _ in range(2))
    start, goal = SE2(c0 + 0.2, r0 + 0.9, 0.0), SE2(c1 + 0.7, r1 + 0.1, 2.0)
    try:
        path = GridPlanner(params).plan(Costmap(cells, 1.0, 0.0, 0.0), start, goal)
    except PlanningError:
        assume(False)
    for a, b in zip(path[:-1, :2], path[1:, :2], strict=True):
        points = a + np.linspace(0, 1, 20)[:, None] * (b - a)
        inner = np.floor(points + 1e-9).astype(int), np.ceil(points - 1e-9).astype(int) - 1
        assert (
            any((cells[at[:, 1], at[:, 0]] < INSCRIBED).all() for at in inner)
            or (
                cells[np.floor(points[:, 1]).astype(int), np.floor(points[:, 0]).astype(int)] < INSCRIBED
            ).all()
        )
    assert tuple(path[0, :2]) == pytest.approx(start[:2])
    assert tuple(path[-1]) == pytest.approx(goal)


def room():
    cells = np.zeros((60, 80), np.uint8)
    cells[:, 40] = LETHAL
    cells[:, 37:40] = cells[:, 41:44] = INSCRIBED
    cells[25:35, 37:44] = 0
    return cells


def plan(cells, start, goal, **changes):
    planner = GridPlanner(PlannerParams(**changes))
    return planner.plan(Costmap(cells, 0.05, 0.0, 0.0), SE2(*start, 0.0), SE2(*goal, 0.0)), planner.notices


def test_path_points_are_evenly_spaced_and_face_forward():
    path, notices = plan(room(), (0.5, 1.5), (3.5, 1.5))
    assert notices == ()
    assert path_length(path) == pytest.approx(3.0, abs=0.01)
    assert np.hypot(*np.diff(path[:, :2], axis=0).T).max() < 0.06
    assert np.abs(path[:, 2]).max() < 0.05


@pytest.mark.parametrize(
    ("start", "goal", "failure"),
    [
        ((-1.0, 1.0), (3.0, 1.0), PlanningFailure.START_OUTSIDE_MAP),
        ((1.0, 1.0), (9.0, 1.0), PlanningFailure.GOAL_OUTSIDE_MAP),
        ((1.0, 1.0), (2.02, 0.5), PlanningFailure.GOAL_OCCUPIED),
        ((2.02, 0.5), (1.0, 1.0), PlanningFailure.START_OCCUPIED),
    ],
)
def test_failures_have_codes_and_messages(start, goal, failure):
    position = r" \(at x .* m, y .* m\)" if "outside" in failure.value else ""
    with pytest.raises(PlanningError, match=f"^{failure.value}{position}$") as error:
        plan(room(), start, goal, tolerance=0.05, escape=0.0)
    assert error.value.failure is failure


def test_a_blocked_goal_is_replaced_within_tolerance():
    path, notices = plan(room(), (0.5, 0.5), (2.02, 0.5), tolerance=0.3)
    assert 0.05 < np.hypot(*(path[-1, :2] - (2.02, 0.5))) <= 0.3
    assert "goal" in notices[0]


def test_an_unreachable_goal_is_replaced_by_a_reachable_one():
    cells = room()
    cells[25:35, 40] = LETHAL
    path, notices = plan(cells, (0.5, 1.5), (2.3, 1.5), tolerance=0.6)
    assert path[-1, 0] < 2.0
    assert len(notices) == 1


def test_a_start_inside_the_inflation_is_left():
    path, notices = plan(room(), (1.88, 0.5), (0.5, 0.5))
    assert tuple(path[0, :2]) == pytest.approx((1.88, 0.5))
    assert "near to an obstacle" in notices[0]


def test_unknown_cells_are_crossed_only_if_allowed():
    cells = np.zeros((20, 60), np.uint8)
    cells[:, 20:30] = UNKNOWN
    with pytest.raises(PlanningError):
        plan(cells, (0.5, 0.5), (2.5, 0.5))
    path, _ = plan(cells, (0.5, 0.5), (2.5, 0.5), allow_unknown=True)
    assert path_length(path) == pytest.approx(2.0, abs=0.01)


def test_a_reused_planner_gives_the_same_path():
    planner, costmap = GridPlanner(), Costmap(room(), 0.05, 0.0, 0.0)
    a, b = SE2(0.5, 0.5, 0.0), SE2(3.5, 2.5, 0.0)
    first = planner.plan(costmap, a, b)
    planner.potential(costmap, b)
    planner.plan(costmap, b, SE2(0.3, 2.0, 0.0))
    assert np.array_equal(planner.plan(costmap, a, b), first)


SHARED = Path(os.environ.get("CHEFBOT_SHARED", Path(__file__).parents[2] / "../shared"))


@pytest.mark.rotated
@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize("name", ["arena2", "den312d", "8room_000", "Berlin_0_256"])
def test_path_lengths_of_movingai_problems_are_optimal(name):
    folder = SHARED / "data" / "grids"
    if not folder.is_dir():
        pytest.skip("the benchmark maps are not there; set CHEFBOT_SHARED to their folder")
    rows = gzip.decompress((folder / f"{name}.map.gz").read_bytes()).decode().splitlines()[4:]
    cells = np.where(np.isin(np.array([list(row) for row in rows]), list(".GS")), 0, LETHAL).astype(np.uint8)
    costmap, planner = Costmap(cells, 1.0, 0.0, 0.0), GridPlanner(RAW)
    problems = gzip.decompress((folder / f"{name}.map.scen.gz").read_bytes()).decode().splitlines()[1:]
    assert problems
    for line in filter(None, problems):
        x0, y0, x1, y1, optimal = (float(field) for field in line.split()[-5:])
        path = planner.plan(costmap, SE2(x0 + 0.5, y0 + 0.5, 0.0), SE2(x1 + 0.5, y1 + 0.5, 0.0))
        assert path_length(path) == pytest.approx(optimal, abs=0.01), line
