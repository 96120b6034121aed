"""Tests the inflation of obstacles against a calculation cell by cell."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from chefbot.costmap.inflation import cost_table, inflate
from chefbot.maths.costs import INSCRIBED, LETHAL, UNKNOWN

maps = arrays(
    np.uint8,
    st.tuples(st.integers(1, 40), st.integers(1, 90)),
    elements=st.sampled_from([0] * 20 + [7, LETHAL, UNKNOWN]),
)


def brute_force(cells, resolution, inscribed, radius, scale):
    """Return the costs by Nav2's definition from the distances between all cells."""
    out = cells.copy()
    lethal = np.argwhere(cells == LETHAL)
    for r, c in np.ndindex(*cells.shape) if len(lethal) else ():
        d = np.sqrt(((lethal - (r, c)) ** 2).sum(axis=1).min()) * resolution
        if d > radius + 1e-9:
            continue
        cost = int(252 * np.exp(-scale * (d - inscribed)))
        cost = LETHAL if d == 0 else INSCRIBED if d <= inscribed else min(cost, 252)
        if cells[r, c] == UNKNOWN:
            out[r, c] = cost if cost >= INSCRIBED else UNKNOWN
        else:
            out[r, c] = max(int(cells[r, c]), cost)
    return out


@settings(max_examples=60)
@given(maps, st.sampled_from([0.03, 0.11, 0.27, 0.55]), st.sampled_from([1.0, 5.0, 20.0]))
def test_inflation_equals_brute_force(cells, radius, scale):
    table = cost_table(0.05, 0.1, radius, scale)
    assert np.array_equal(inflate(cells, table), brute_force(cells, 0.05, 0.1, radius, scale))


def test_inflation_does_not_modify_its_argument():
    cells = np.zeros((9, 9), np.uint8)
    cells[4, 4] = LETHAL
    before = cells.copy()
    inflate(cells, cost_table(0.05, 0.1, 0.2, 5.0))
    assert np.array_equal(cells, before)


@pytest.mark.parametrize("shape", [(0, 5), (5, 0), (1, 1)])
def test_inflation_of_degenerate_shapes(shape):
    assert inflate(np.zeros(shape, np.uint8), cost_table(0.05, 0.1, 0.5, 5.0)).shape == shape


def test_costs_fall_with_distance():
    assert (np.diff(cost_table(0.05, 0.2, 1.0, 3.0).astype(int)) <= 0).all()
