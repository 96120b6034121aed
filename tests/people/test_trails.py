"""Tests which places people have left."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point
from chefbot.people.trails import LEFT_DISTANCE, MAX_PLACES, PeopleTrails

positions = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))


def people(*given: tuple[float, float], visible: bool = True, variance: float = 0.001) -> TrackedPeople:
    """Return people with the numbers 1, 2, ... at these places."""
    covariance = variance * np.eye(4).reshape(16)
    return TrackedPeople(
        people=tuple(
            TrackedPerson(k + 1, Point(x, y), covariance=covariance, visible=visible)
            for k, (x, y) in enumerate(given)
        )
    )


def test_a_place_is_left_once_the_person_is_elsewhere() -> None:
    trails = PeopleTrails()
    assert len(trails.left(people((0.0, 0.0)))) == 0
    assert len(trails.left(people((0.5 * LEFT_DISTANCE, 0.0)))) == 0
    assert trails.left(people((1.1 * LEFT_DISTANCE, 0.0))).tolist() == [[0.0, 0.0]]
    assert len(trails.left(people((1.1 * LEFT_DISTANCE, 0.0)))) == 0


def test_places_of_the_lost_and_the_hidden_are_not_left() -> None:
    for second in (people(), people((0.4, 0.0), visible=False), people((0.4, 0.0), variance=0.1)):
        trails = PeopleTrails()
        trails.left(people((0.0, 0.0)))
        assert len(trails.left(second)) == 0
        assert len(trails.left(people((0.8, 0.0)))) == 0


def test_somebody_else_with_the_same_number_has_left_nothing() -> None:
    trails = PeopleTrails()
    trails.left(people((0.0, 0.0)))
    assert len(trails.left(people((3.0, 0.0)))) == 0
    assert len(trails.left(people((3.4, 0.0)))) == 0


@given(st.lists(st.lists(positions, max_size=3), max_size=12))
def test_no_place_is_left_at_which_somebody_is(history: list[list[tuple[float, float]]]) -> None:
    trails, seen = PeopleTrails(), set[tuple[float, float]]()
    for now in history:
        gone = trails.left(people(*now)).tolist()
        seen |= set(now)
        for place in gone:
            assert tuple(place) in seen
            assert all(math.dist(place, other) > LEFT_DISTANCE for other in now)


def test_memory_is_bounded() -> None:
    trails = PeopleTrails()
    for k in range(5 * MAX_PLACES):  # the second person covers what the first one leaves
        trails.left(people((0.2 * math.sin(k), 0.2 * math.cos(k)), (0.0, 0.0)))
    assert len(trails._trails[1]) <= MAX_PLACES
