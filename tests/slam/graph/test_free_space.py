"""Tests the free space of a submap: where its rays passed, and which points of another submap contradict it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, box

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.free_space import count_explained, mark_free
from chefbot.slam.graph.surface_grid import CELL

ORIGIN = np.array([-2.0, -1.0])
BEFORE_SURFACE, MAX_RAY = 0.3, 20.0
"""Part of a ray before the surface that is not counted as free, and its largest length, m."""
COORDINATE = st.floats(-2.5, 2.5, width=32)
POSE = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-4.0, 4.0))


def drawn(sensor, ends, pose=(0.0, 0.0, 0.0), shape=(30, 40), origin=ORIGIN) -> np.ndarray:
    free = np.zeros(shape, np.uint8)
    ends = np.array(ends, np.float32).reshape(-1, 2)
    mark_free(free, origin, np.array(sensor, np.float32), ends, np.array(pose, np.float64))
    return free


def cell_at(row: int, column: int):
    x, y = ORIGIN + CELL * np.array([column, row])
    return box(x, y, x + CELL, y + CELL)


@settings(max_examples=25)
@given(st.tuples(COORDINATE, COORDINATE), st.tuples(COORDINATE, COORDINATE), POSE)
def test_free_cells_are_those_on_the_way_to_the_surface(sensor, end, pose) -> None:
    free = drawn(sensor, end, pose)
    (x0, y0), (x1, y1) = SE2(*pose).apply(np.array([sensor, end], float)).tolist()
    length = math.hypot(x1 - x0, y1 - y0)
    if length <= BEFORE_SURFACE:
        assert not free.any()
        return

    def ray(part: float) -> LineString:
        share = max(part, 0.0) / length
        return LineString([(x0, y0), (x0 + share * (x1 - x0), y0 + share * (y1 - y0))])

    crossed, surely = ray(length - BEFORE_SURFACE), ray(length - BEFORE_SURFACE - 2.0 * CELL)
    for row in range(free.shape[0]):
        for column in range(free.shape[1]):
            cell = cell_at(row, column)
            if free[row, column]:
                assert cell.distance(crossed) < 1e-6
            elif length > BEFORE_SURFACE + 2.0 * CELL:
                assert cell.intersection(surely).length < CELL + 1e-6, "no step passes over it"


def test_a_ray_along_an_axis_frees_its_row_of_cells() -> None:
    free = drawn((0.05, 0.05), [(1.11, 0.05)])
    rows, columns = np.nonzero(free)
    assert set(rows) == {10}
    assert columns.tolist() == [20, 21, 22, 23, 24, 25, 26]


def test_no_ray_frees_what_is_farther_than_it_is_drawn() -> None:
    free = drawn((0.05, 0.05), [(60.0, 0.05)], shape=(20, 400), origin=np.zeros(2))
    assert np.flatnonzero(free.any(axis=0)).max() * CELL == pytest.approx(MAX_RAY, abs=2.0 * CELL)


def test_rays_without_length_or_off_the_grid_free_nothing() -> None:
    assert not drawn((0.5, 0.5), [(0.5, 0.5)]).any()
    assert not drawn((0.5, 0.5), [(1.5, 0.5)], pose=(100.0, 0.0, 0.0)).any()
    assert not drawn((0.5, 0.5), np.zeros((0, 2))).any()


@settings(max_examples=40)
@given(POSE, st.integers(0, 10_000), st.integers(0, 60))
def test_points_are_counted_by_the_cells_that_hold_them(pose, seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-2.5, 2.5, (count, 2)).astype(np.float32)
    field, free = rng.choice([0, 7, 8, 59, 60, 255], (30, 40)).astype(np.uint8), rng.integers(0, 2, (30, 40))
    explained = contradicted = 0
    for x, y in SE2(*pose).apply(points.astype(float)):
        row, column = math.floor((y - ORIGIN[1]) / CELL), math.floor((x - ORIGIN[0]) / CELL)
        if 0 <= row < 30 and 0 <= column < 40:
            explained += field[row, column] >= 60
            contradicted += bool(free[row, column]) and field[row, column] < 8
    found = count_explained(points, np.array(pose), field, free.astype(np.uint8), ORIGIN)
    assert found == (explained, contradicted)
