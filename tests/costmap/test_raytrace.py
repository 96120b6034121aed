"""Tests that ray tracing clips beams to the map: same cells as the full line, and time bounded by the map's size."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.costmap import raytrace
from chefbot.maths.costs import FREE, LETHAL, UNKNOWN

SHAPE = (17, 23)
NEAR = st.floats(-200.0, 200.0)
EXTREME = st.sampled_from(
    [math.nan, math.inf, -math.inf, 1e9, -1e9, 2e10, -2e10, 1e19, -1e300, 1e308, 5e-324]
)
ANYTHING = st.floats(-30.0, 30.0) | EXTREME | st.floats(-1e9, 1e9)


def walk_line(x0: float, y0: float, x1: float, y1: float) -> NDArray[np.uint8]:
    """Return the map after walking along the line cell by cell, inside and outside the map."""
    cells = np.full(SHAPE, UNKNOWN, np.uint8)
    steps = max(abs(math.floor(x1) - math.floor(x0)), abs(math.floor(y1) - math.floor(y0)))
    one = 1 << raytrace.FRACTION_BITS
    x, y = int(x0 * one), int(y0 * one)
    for _ in range(steps):
        c, r = x >> raytrace.FRACTION_BITS, y >> raytrace.FRACTION_BITS
        inside = 0 <= r < SHAPE[0] and 0 <= c < SHAPE[1]
        if inside and (c, r) != (math.floor(x1), math.floor(y1)):
            cells[r, c] = FREE
        x += int((x1 - x0) / steps * one)
        y += int((y1 - y0) / steps * one)
    return cells


@given(NEAR, NEAR, NEAR, NEAR)
@example(-100.0, 5.5, 100.0, 5.5)
@example(5.5, 100.0, 5.5, -100.0)
@example(100.0, 100.0, -100.0, -99.0)
def test_a_clipped_line_clears_the_cells_of_the_full_line(x0: float, y0: float, x1: float, y1: float) -> None:
    cells = np.full(SHAPE, UNKNOWN, np.uint8)
    raytrace._clear_line(cells, cells, x0, y0, x1, y1, 0.0, math.inf)
    np.testing.assert_array_equal(cells, walk_line(x0, y0, x1, y1))


@settings(max_examples=300)
@given(*[st.lists(ANYTHING, min_size=4, max_size=4)] * 3, st.tuples(ANYTHING, ANYTHING, ANYTHING))
@example([0.0] * 4, [math.nan] * 4, [4.0] * 4, (0.0, 0.0, 0.0))
@example([0.0] * 4, [math.nan] * 4, [4.0] * 4, (1e9, 0.0, math.pi))
@example([0.5] * 4, [-1.0] * 4, [4.0] * 4, (1.0, math.nan, 0.0))
@example([0.5] * 4, [-1.0] * 4, [4.0] * 4, (math.nan, 1.0, 0.0))
@pytest.mark.slow
def test_no_beam_writes_outside_the_map(
    angles: list[float], ranges: list[float], clear: list[float], sensor: tuple[float, float, float]
) -> None:
    """The map is the middle of a larger array, whose other cells must not change."""
    around = np.full((SHAPE[0] + 8, SHAPE[1]), UNKNOWN, np.uint8)
    cells = around[4:-4]
    near = np.array(ranges[::-1])
    raytrace.mark_and_clear(
        cells,
        0.05,
        0.0,
        0.0,
        np.array(sensor),
        np.array(angles),
        np.array(ranges),
        near,
        np.array(clear),
        cells,
        np.zeros(SHAPE),
        0.0,
    )
    assert (around[:4] == UNKNOWN).all()
    assert (around[-4:] == UNKNOWN).all()
    assert np.isin(cells, (UNKNOWN, FREE, LETHAL)).all()


def test_a_beam_from_far_outside_costs_no_more_than_one_within() -> None:
    """Without clipping each of these beams has 2e10 cells, and all together would take days."""
    n = 1000
    cells = np.full(SHAPE, UNKNOWN, np.uint8)
    angles, far = np.linspace(-3.0, 3.0, n), np.full(n, 4.0)
    for start in (-1e6, -4e7, -1e9, -1e300):
        raytrace.mark_and_clear(
            cells,
            0.05,
            0.0,
            0.0,
            np.array([0.5, 0.5, 0.0]),
            angles,
            np.full(n, np.nan),
            np.full(n, start),
            far,
            cells,
            np.zeros(SHAPE),
            0.0,
        )
    assert (cells != LETHAL).all()
