"""Tests the paths of people: their cost by Dijkstra's algorithm, and the points on them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from chefbot.sim.people.distance_field import distance_at, lower_to_boxes
from chefbot.sim.people.navigation_functions import (
    LOOKAHEAD,
    NARROW_FACTOR,
    ROOM,
    STRAIGHT,
    UNREACHABLE,
    next_point,
    path_cost,
    spread,
    step_weights,
)

PATH_FRAME, FRAME = np.array([-1.0, 2.0, 0.1]), np.array([-1.0, 2.0, 0.05])
ROWS, COLUMNS, RADIUS = 30, 40, 0.25
QUICK = settings(max_examples=30)


def by_dijkstra(weights: np.ndarray, row: int, column: int) -> np.ndarray:
    """Return the least cost from each cell, where a step costs what the cell that is nearer the end is left for."""
    h, w = weights.shape
    starts, ends, costs = [], [], []
    for (r, c), dr, dc in itertools.product(np.ndindex(h, w), (-1, 0, 1), (-1, 0, 1)):
        nr, nc = r + dr, c + dc
        if (dr, dc) == (0, 0) or not (0 <= nr < h and 0 <= nc < w) or weights[nr, nc] == 0:
            continue
        if weights[r, nc] == 0 or weights[nr, c] == 0:
            continue
        starts.append(r * w + c)
        ends.append(nr * w + nc)
        costs.append(weights[nr, nc] * 14 // 10 if dr and dc else weights[nr, nc])
    graph = csr_matrix((costs, (starts, ends)), (h * w, h * w))
    found = dijkstra(graph, indices=row * w + column).reshape(h, w)
    return np.where(np.isinf(found), UNREACHABLE, found)


def weights_around(boxes) -> tuple[np.ndarray, np.ndarray]:
    """Return distance field and weights of a room with boxes (x, y, half side)."""
    field = np.full((2 * ROWS, 2 * COLUMNS), 1.5, np.float32)
    middle, half = (1.0, 3.5), (2.0, 1.5)
    sides = [(middle[0] + sx * half[0], middle[1], 0.0, half[1]) for sx in (-1, 1)]
    sides += [(middle[0], middle[1] + sy * half[1], half[0], 0.0) for sy in (-1, 1)]
    rows = [(*side, 1.0, 0.0, 0.0) for side in sides] + [(x, y, r, r, 1.0, 0.0, 0.0) for x, y, r in boxes]
    lower_to_boxes(field, FRAME, np.array(rows), 1.5)
    weights = np.zeros((ROWS, COLUMNS), np.int32)
    step_weights(field, FRAME, PATH_FRAME, RADIUS, weights)
    return field, weights


def costs_to(weights: np.ndarray, x: float, y: float) -> np.ndarray:
    costs = np.zeros_like(weights)
    spread(weights, *cell_of(x, y), costs)
    return costs


def cell_of(x: float, y: float) -> tuple[int, int]:
    return math.floor((y - 2.0) / 0.1), math.floor((x + 1.0) / 0.1)


@QUICK
@given(st.integers(0, 10_000), st.integers(1, 9), st.integers(1, 9))
def test_the_cost_of_paths_is_minimal(seed: int, height: int, width: int) -> None:
    rng = np.random.default_rng(seed)
    weights = rng.choice([0, 10, 13, 30], (height, width), p=[0.3, 0.4, 0.2, 0.1]).astype(np.int32)
    row, column = int(rng.integers(height)), int(rng.integers(width))
    weights[row, column] = 10
    costs = np.zeros_like(weights)
    spread(weights, row, column, costs)
    assert np.array_equal(costs, by_dijkstra(weights, row, column))


def test_no_path_cuts_a_corner() -> None:
    weights = np.array([[10, 0], [0, 10]], np.int32)
    costs = np.zeros_like(weights)
    spread(weights, 0, 0, costs)
    assert costs.tolist() == [[0, UNREACHABLE], [UNREACHABLE, UNREACHABLE]]


@pytest.mark.parametrize(
    ("free", "weight"),
    [(0.0, 0), (0.99 * RADIUS, 0), (RADIUS + 1e-6, 29), (0.424, 20), (ROOM, 10), (1.5, 10)],
)
def test_narrow_places_cost_more_and_tight_ones_are_closed(free: float, weight: int) -> None:
    weights = np.zeros((3, 3), np.int32)
    step_weights(np.full((6, 6), free, np.float32), FRAME, PATH_FRAME, RADIUS, weights)
    assert weights[1, 1] == weight
    assert weight <= STRAIGHT * NARROW_FACTOR


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.floats(-2.0, 4.0), st.floats(1.0, 6.0))
def test_the_path_begins_at_the_best_cell_around(seed: int, x: float, y: float) -> None:
    costs = np.random.default_rng(seed).integers(0, 500, (ROWS, COLUMNS)).astype(np.int32)
    row, column = cell_of(x, y)
    around = [
        costs[r, c]
        for r in range(row - 1, row + 2)
        for c in range(column - 1, column + 2)
        if 0 <= r < ROWS and 0 <= c < COLUMNS
    ]
    assert path_cost(costs, PATH_FRAME, x, y) == min(around, default=UNREACHABLE)


FREE_POINT = st.tuples(st.floats(-0.6, 2.6), st.floats(2.4, 4.6))


@QUICK
@given(FREE_POINT, FREE_POINT, st.floats(-0.2, 2.2), st.floats(2.8, 4.2))
def test_points_of_the_path_lead_to_the_destination(start, end, x: float, y: float) -> None:
    field, weights = weights_around([(x, y, 0.3)])
    costs = costs_to(weights, *end)
    if weights[cell_of(*start)] == 0 or weights[cell_of(*end)] == 0 or costs[cell_of(*start)] == UNREACHABLE:
        return
    at, left = start, [path_cost(costs, PATH_FRAME, *start)]
    for _ in range(40):
        px, py = next_point(costs, PATH_FRAME, field, FRAME, *at, RADIUS)
        assert distance_at(field, FRAME, px, py) >= RADIUS - 1e-6, "a person fits there"
        assert math.dist(at, (px, py)) <= 1.5 * 0.1 * (LOOKAHEAD + 1)
        if (px, py) == at or cell_of(px, py) == cell_of(*end):
            at = px, py
            break
        at = px, py
        left.append(costs[cell_of(px, py)])
    assert cell_of(*at) == cell_of(*end)
    assert all(b < a for a, b in itertools.pairwise(left[1:])), "each is nearer than the one before"


def test_where_no_path_leads_people_stay() -> None:
    field, weights = weights_around([])
    costs = np.full_like(weights, UNREACHABLE)
    assert next_point(costs, PATH_FRAME, field, FRAME, 0.5, 3.0, RADIUS) == (0.5, 3.0)
    assert path_cost(costs, PATH_FRAME, 0.5, 3.0) == UNREACHABLE


def test_in_the_open_people_look_far_ahead() -> None:
    field, weights = weights_around([])
    px, py = next_point(costs_to(weights, 2.5, 3.5), PATH_FRAME, field, FRAME, -0.5, 3.5, RADIUS)
    assert px == pytest.approx(-0.5 + 0.1 * LOOKAHEAD, abs=0.11) and py == pytest.approx(3.5, abs=0.1)


def test_around_a_corner_the_next_point_is_in_sight() -> None:
    field, weights = weights_around([(1.0, 2.6, 0.6)])
    costs = costs_to(weights, 2.3, 2.4)
    px, py = next_point(costs, PATH_FRAME, field, FRAME, 0.1, 2.8, RADIUS)
    assert py > 2.9, "over the box"
    line = [(0.1 + t * (px - 0.1), 2.8 + t * (py - 2.8)) for t in np.linspace(0.0, 1.0, 50)]
    assert min(distance_at(field, FRAME, *point) for point in line) > RADIUS - 0.03
