"""The shortest order of stops is that of trying all orders."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.delivery.shortest_order import MAX_STOPS, shortest_order

Lengths = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def lengths(seed: int, stops: int) -> Lengths:
    """Lengths that differ by direction, as with one-way lanes."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 50, stops), rng.uniform(0, 50, (stops, stops)), rng.uniform(0, 50, stops)


def route_length(order: tuple[int, ...] | list[int], known: Lengths) -> float:
    first, between, last = known
    return float(first[order[0]] + sum(between[a, b] for a, b in itertools.pairwise(order)) + last[order[-1]])


@given(seed=st.integers(0, 10_000), stops=st.integers(1, 6))
def test_no_other_order_is_shorter(seed: int, stops: int) -> None:
    known = lengths(seed, stops)
    order = shortest_order(*known)
    assert sorted(order) == list(range(stops))
    shortest = min(route_length(other, known) for other in itertools.permutations(range(stops)))
    assert route_length(order, known) == pytest.approx(shortest)


def test_stops_along_a_corridor_are_served_on_the_way() -> None:
    places = np.array([8.0, 2.0, 5.0, 11.0])
    between = abs(places[:, None] - places)
    assert shortest_order(places, between, abs(20.0 - places)) == [1, 2, 0, 3]


def test_the_largest_round_is_sorted() -> None:
    known = lengths(3, MAX_STOPS)
    order = shortest_order(*known)
    assert sorted(order) == list(range(MAX_STOPS))
    swapped = [[*order[:i], order[i + 1], order[i], *order[i + 2 :]] for i in range(MAX_STOPS - 1)]
    assert all(route_length(order, known) <= route_length(other, known) for other in swapped)
