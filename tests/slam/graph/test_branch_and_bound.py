"""Tests that branch and bound finds what an exhaustive search finds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.slam.graph.branch_and_bound import SearchWindow, search
from chefbot.slam.graph.field_pyramid import LEVELS, field_pyramid
from chefbot.slam.graph.surface_grid import CELL, FIELD_MAX


def exhaustive(points, window: SearchWindow, field, origin) -> float:
    """Return the highest mean field value of all poses of the window."""
    turns, radius = math.ceil(window.angular / window.turn), math.ceil(window.linear / CELL)
    best = 0.0
    for k in range(-turns, turns + 1):
        c, s = math.cos(window.centre[2] + k * window.turn), math.sin(window.centre[2] + k * window.turn)
        x = c * points[:, 0] - s * points[:, 1] + window.centre[0]
        y = s * points[:, 0] + c * points[:, 1] + window.centre[1]
        column, row = (
            np.floor((x - origin[0]) / CELL).astype(int),
            np.floor((y - origin[1]) / CELL).astype(int),
        )
        for dy in range(-radius, radius + 1):
            for dx in range(-radius, radius + 1):
                u, v = column + dx, row + dy
                known = (u >= 0) & (v >= 0) & (u < field.shape[1]) & (v < field.shape[0])
                best = max(best, float(field[v[known], u[known]].sum()))
    return best / (FIELD_MAX * len(points))


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    linear=st.floats(0.05, 1.5),
    angular=st.floats(0.01, 0.5),
    x=st.floats(-4.0, 4.0),
    y=st.floats(-4.0, 4.0),
    yaw=st.floats(-3.0, 3.0),
)
def test_the_best_pose_is_that_of_an_exhaustive_search(seed, linear, angular, x, y, yaw) -> None:
    rng = np.random.default_rng(seed)
    field = (rng.integers(0, 256, (40, 50)) * (rng.random((40, 50)) < 0.1)).astype(np.uint8)
    points = rng.uniform(-2.0, 2.0, (12, 2)).astype(np.float32)
    window, origin = SearchWindow(np.array([x, y, yaw]), linear, angular, 0.1), np.array([-2.5, -2.0])
    best = exhaustive(points, window, field, origin)
    found = search(points, window, field_pyramid(field), origin, 0.0)
    assert (found is None) == (best == 0.0)
    if found is not None:
        assert found[1] == pytest.approx(best, abs=1e-12)
        assert np.abs(found[0][:2] - window.centre[:2]).max() <= linear + CELL


@given(seed=st.integers(0, 10_000), height=st.integers(1, 90), width=st.integers(1, 90))
@settings(max_examples=25, deadline=None)
def test_levels_hold_the_maxima_of_blocks(seed: int, height: int, width: int) -> None:
    rng = np.random.default_rng(seed)
    field = rng.integers(0, 256, (height, width)).astype(np.uint8)
    levels = field_pyramid(field)
    for level in range(LEVELS + 1):
        row, column = rng.integers(levels.shape[1]), rng.integers(levels.shape[2])
        block = levels[0, row : row + (1 << level), column : column + (1 << level)]
        assert levels[level, row, column] == block.max()


def test_no_pose_below_the_limit_is_returned() -> None:
    field = np.zeros((30, 30), np.uint8)
    field[10:20, 15] = FIELD_MAX
    points = np.column_stack([np.zeros(20), np.linspace(-1.0, 1.0, 20)]).astype(np.float32)
    window = SearchWindow(np.array([1.0, 1.0, 0.0]), 1.0, 0.2, 0.02)
    found = search(points, window, field_pyramid(field), np.zeros(2), 0.3)
    assert found is not None and found[1] >= 0.3
    assert search(points, window, field_pyramid(field), np.zeros(2), 0.9) is None
