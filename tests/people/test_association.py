"""Properties of the association of measurements to tracks."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from chefbot.people.association import NO_TRACK, associate

GATE = 9.21
costs_of_any = arrays.arrays(
    np.float64,
    st.tuples(st.integers(0, 6), st.integers(0, 6)),
    elements=st.one_of(st.floats(0.0, 20.0), st.just(np.inf), st.just(np.nan)),
)
small_costs = arrays.arrays(
    np.float64, st.tuples(st.integers(1, 3), st.integers(1, 4)), elements=st.floats(0.0, 12.0)
)


@given(costs_of_any, st.integers(1, 2))
def test_tracks_take_no_more_than_their_slots_within_the_gate(costs: np.ndarray, slots: int) -> None:
    found = associate(costs, GATE, slots)
    assert found.shape == (costs.shape[1],)
    for j, i in enumerate(found.tolist()):
        assert i == NO_TRACK or costs[i, j] < GATE
    taken = found[found != NO_TRACK]
    assert all(count <= slots for count in np.bincount(taken).tolist()) if len(taken) else True


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 8))
def test_the_order_of_tracks_and_measurements_does_not_matter(seed: int, tracks: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    costs = rng.uniform(0.0, 15.0, (tracks, count))
    rows, columns = rng.permutation(tracks), rng.permutation(count)
    found, permuted = associate(costs, GATE, 2, 1.5), associate(costs[rows][:, columns], GATE, 2, 1.5)
    back = np.where(permuted == NO_TRACK, NO_TRACK, rows[permuted])
    assert np.array_equal(found[columns], back)


def total(costs: np.ndarray, found: tuple[int, ...]) -> float:
    """Return the sum of costs of an association, the gate for each measurement without a track."""
    return sum(GATE if i == NO_TRACK else float(costs[i, j]) for j, i in enumerate(found))


@given(small_costs)
def test_no_other_association_costs_less(costs: np.ndarray) -> None:
    tracks, count = costs.shape
    choices = product(range(NO_TRACK, tracks), repeat=count)
    allowed = (c for c in choices if all(c.count(i) <= 1 for i in range(tracks)))
    best = min(total(costs, c) for c in allowed)
    assert total(costs, tuple(associate(costs, GATE).tolist())) == pytest.approx(best)
