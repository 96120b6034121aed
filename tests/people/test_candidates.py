"""Tests which segments may be people, where these stand, and which legs belong together."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.people.scene import LEG_RADIUS, ORIGIN, legs, observe

from chefbot.maths.grid import FREE, OCCUPIED, Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.people.background import STATIC_EVIDENCE, Background
from chefbot.people.candidates import (
    LEG_DEPTH,
    LEG_DISTANCE,
    LEG_WIDTH,
    MAX_WIDTH,
    SECOND_LEG,
    Candidates,
    find_candidates,
    group_legs,
    measure,
)
from chefbot.people.observation import Observation
from chefbot.people.segmentation import Segments, find_segments

PLACES = st.lists(st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)), max_size=9)
NONE_FREE = math.inf
RANGE = 12.0


def candidates_at(places, sensor: SE2 = IDENTITY, width: float = 0.15, **flags) -> Candidates:
    """Return legs whose centres are at places (m, 2); flags are for all alike or (m,)."""
    position = np.array(places, float).reshape(-1, 2)
    m, centre = len(position), position.copy()
    distance = np.hypot(*(centre - sensor[:2]).T)
    zeros = np.zeros(m)
    numbers = np.arange(m)
    segments = Segments(
        10 * numbers,
        10 * numbers + 3,
        centre,
        distance,
        zeros + width,
        zeros + 4.0,
        zeros + 1.0,
        zeros > 0,
        zeros > 0,
    )
    names = ("broad", "leg", "body", "apart", "novel", "stays", "on_map", "on_floor")
    given = {name: np.broadcast_to(np.array(flags.get(name, False)), m).copy() for name in names}
    return Candidates(segments, position, **given)


def found_in(observation: Observation, background: Background | None = None, transform=None) -> Candidates:
    segments = find_segments(observation)
    return find_candidates(observation, segments, background or Background(), transform, NONE_FREE, RANGE)


def beams(angles, ranges) -> Observation:
    n = len(angles)
    return Observation(ORIGIN, angles, ranges, np.zeros(n), np.nan_to_num(ranges), np.ones(n, np.bool_))


def scan(points) -> Observation:
    """Return beams that end at points (n, 2), in the order of their bearings, without more."""
    x, y = np.array(points, float).T
    return beams(np.arctan2(y, x), np.hypot(x, y))


@pytest.mark.parametrize("heading", [0.0, 1.0, math.pi / 2])
@pytest.mark.parametrize("place", [(1.5, 0.5), (-1.0, 1.8), (0.3, -2.2)])
def test_legs_of_a_person_are_found_at_their_centres(place, heading: float) -> None:
    discs = legs(*place, heading)
    found = found_in(observe(discs))
    near = np.hypot(*(found.position - place).T) < 0.4
    assert near.any()
    for x, y in found.position[near]:
        assert min(math.dist((x, y), disc[:2]) for disc in discs) < LEG_RADIUS
    assert found.leg[near].any()
    assert (found.segments.width[near] < 2.5 * LEG_RADIUS).all()


@pytest.mark.parametrize("half_side", [1.0, 2.0, 4.0, 6.0, 10.0])
def test_walls_all_around_are_not_candidates(half_side: float) -> None:
    bearings = np.radians(np.arange(360.0) - 180.0)
    ranges = half_side / np.maximum(np.abs(np.cos(bearings)), np.abs(np.sin(bearings)))
    assert found_in(beams(bearings, ranges)).size == 0


def test_posts_all_around_are_not_legs() -> None:
    bearings = np.radians(np.arange(360.0) - 180.0)
    fence = np.where(np.arange(360) // 5 % 2, 2.0, 2.25)
    assert found_in(beams(bearings, fence)).size == 72
    assert not found_in(beams(bearings, fence)).leg.any()


@pytest.mark.parametrize(("width", "leg"), [(0.04, False), (0.12, True), (0.22, True), (0.3, False)])
def test_a_leg_is_neither_thin_nor_broad(width: float, leg: bool) -> None:
    y = np.linspace(-width / 2, width / 2, 9)
    found = found_in(scan(np.column_stack([np.full(9, 1.5), y])))
    assert found.size == 1 and bool(found.leg[0]) == leg
    assert LEG_WIDTH[0] <= width <= LEG_WIDTH[1] or not leg


@pytest.mark.parametrize(("width", "count"), [(0.9 * MAX_WIDTH, 1), (1.1 * MAX_WIDTH, 0)])
def test_what_is_wider_than_a_person_is_not_a_candidate(width: float, count: int) -> None:
    y = np.linspace(-width / 2, width / 2, 30)
    assert found_in(scan(np.column_stack([np.full(30, 1.5), y]))).size == count


@pytest.mark.parametrize(("distance", "count"), [(1.5, 0), (2.4, 0), (2.6, 1), (4.5, 1), (RANGE + 1.0, 0)])
def test_one_return_is_a_candidate_from_afar_only(distance: float, count: int) -> None:
    ranges = np.full(9, math.nan)
    ranges[4] = distance
    assert found_in(beams(np.radians(np.arange(9.0)), ranges)).size == count


def test_legs_of_a_chain_as_long_as_a_wall_are_not_legs() -> None:
    leg = np.column_stack([np.full(9, 2.0), np.linspace(-0.07, 0.07, 9)])
    posts = [[2.0, y] for y in np.arange(0.35, 1.9, 0.28) for y in (y, y + 0.01)]
    assert found_in(scan(leg)).leg.tolist() == [True]
    beside = found_in(scan(np.concatenate([leg, posts])))
    assert not beside.leg.any(), "pieces of a wall"
    away = [[x, y + 0.6] for x, y in posts]
    apart = found_in(scan(np.concatenate([leg, away])))
    assert apart.leg.sum() == 1


def test_what_is_new_on_free_floor_is_novel() -> None:
    background, empty, person = Background(), observe([]), observe(legs(1.5, 0.5, 0.0))
    segments = find_segments(person)

    def novel(transform: SE2 | None = None) -> list[bool]:
        found = find_candidates(person, segments, background, transform, -1.0, RANGE)
        return found.novel[np.hypot(*(found.position - (1.5, 0.5)).T) < 0.4].tolist()

    assert not any(novel()), "the floor was not seen yet"
    for k in range(3):
        background.update(empty, np.zeros(len(empty.ranges), np.bool_), 0.1 * k, RANGE)
    assert novel() and all(novel())
    background.set_map(Grid(np.full((90, 90), FREE, np.int8), 0.1, -4.5, -4.5))
    assert not any(novel()), "on a map, floor has to be known as free"
    assert all(novel(IDENTITY))
    for k in range(STATIC_EVIDENCE):
        background.update(person, np.zeros(len(person.ranges), np.bool_), 1.0 + 0.1 * k, RANGE)
    assert not any(novel(IDENTITY)), "it stays"


def test_a_leg_at_an_obstacle_of_the_map_is_on_it() -> None:
    background = Background()
    cells = np.full((90, 90), FREE, np.int8)
    cells[49:52, 59:62] = OCCUPIED
    background.set_map(Grid(cells, 0.1, -4.5, -4.5))
    on, beside = (found_in(observe(legs(x, 0.55, 0.0)), background, IDENTITY) for x in (1.55, 2.6))
    assert on.on_map.any() and beside.size
    assert not beside.on_map.any() and beside.on_floor.all()


@settings(max_examples=60)
@given(PLACES)
@pytest.mark.slow
def test_legs_pair_up_the_nearest_first(places) -> None:
    candidates = candidates_at(places)
    groups = group_legs(candidates, np.arange(len(places)))
    members = [number for group in groups for number in group.tolist()]
    assert sorted(members) == list(range(len(places))), "each is in one group"
    pairs = [group.tolist() for group in groups if len(group) == 2]
    gaps = [math.dist(places[a], places[b]) for a, b in pairs]
    assert gaps == sorted(gaps) and all(gap <= LEG_DISTANCE[1] for gap in gaps)
    single = [group[0] for group in groups if len(group) == 1]
    for a, b in itertools.combinations(single, 2):
        assert math.dist(places[a], places[b]) > LEG_DISTANCE[1]
    for number, (a, b) in itertools.product(single, pairs):
        nearer = min(math.dist(places[number], places[a]), math.dist(places[number], places[b]))
        assert nearer >= math.dist(places[a], places[b]) - 1e-12 or nearer > LEG_DISTANCE[1]


def test_only_free_candidates_pair_up() -> None:
    candidates = candidates_at([(0.0, 2.0), (0.1, 2.0), (0.3, 2.0), (3.0, 2.0)])
    groups = [group.tolist() for group in group_legs(candidates, np.array([0, 2, 3]))]
    assert groups == [[0, 2], [3]]
    assert group_legs(candidates, np.zeros(0, np.int64)) == []


def test_a_person_is_between_two_legs() -> None:
    candidates = candidates_at([(1.9, 0.1), (2.1, -0.1)], leg=True, on_floor=[True, False])
    seen = measure(candidates, np.array([0, 1]), ORIGIN)
    assert (seen.x, seen.y) == (pytest.approx(2.0), pytest.approx(0.0))
    assert seen.pair and seen.leg and not seen.body and not seen.novel


@pytest.mark.parametrize("gap", [0.5 * LEG_DISTANCE[0], 1.1 * LEG_DISTANCE[1]])
def test_legs_too_near_or_too_far_are_not_a_pair(gap: float) -> None:
    candidates = candidates_at([(2.0, 0.0), (2.0, gap)], leg=True)
    assert not measure(candidates, np.array([0, 1]), ORIGIN).pair
    narrow = candidates_at([(2.0, 0.0), (2.0, 0.3)], leg=[True, False])
    assert not measure(narrow, np.array([0, 1]), ORIGIN).pair


@settings(max_examples=40)
@given(st.floats(0.5, 2.4), st.floats(-math.pi, math.pi))
def test_the_second_leg_is_behind_a_single_one(distance: float, bearing: float) -> None:
    sensor = SE2(0.4, -0.3, 1.0)
    x, y = 0.4 + distance * math.cos(bearing), -0.3 + distance * math.sin(bearing)
    one, wide = candidates_at([(x, y)], sensor), candidates_at([(x, y)], sensor, width=0.4)
    seen, body = measure(one, np.array([0]), sensor), measure(wide, np.array([0]), sensor)
    assert math.dist((seen.x, seen.y), sensor[:2]) == pytest.approx(distance + SECOND_LEG)
    assert math.dist((seen.x, seen.y), (x, y)) == pytest.approx(SECOND_LEG)
    assert (body.x, body.y) == (pytest.approx(x), pytest.approx(y))
    assert seen.deviation > body.deviation


def test_from_afar_one_segment_may_be_both_legs() -> None:
    seen = measure(candidates_at([(3.0, 0.0)]), np.array([0]), ORIGIN)
    assert seen.x == 3.0


def test_evidence_of_a_person_is_that_of_its_legs() -> None:
    both = np.array([0, 1])
    places = [(1.9, 0.1), (2.1, -0.1)]
    assert measure(candidates_at(places, novel=[True, False], broad=[True, False]), both, ORIGIN).novel
    assert not measure(candidates_at(places, novel=[True, False], broad=[False, True]), both, ORIGIN).novel
    assert not measure(candidates_at(places, body=True), both, ORIGIN).body, "not on free floor"
    assert measure(candidates_at(places, body=True, on_floor=True), both, ORIGIN).body
    assert measure(candidates_at(places, on_map=True), both, ORIGIN).on_map
    assert not measure(candidates_at(places, on_map=[True, False]), both, ORIGIN).on_map


@settings(max_examples=40)
@given(PLACES, st.integers(0, 9))
def test_the_nearest_are_kept_in_the_order_of_beams(places, count: int) -> None:
    candidates = candidates_at(places)
    nearest = candidates.nearest(count)
    assert nearest.size == min(count, len(places))
    assert np.all(np.diff(nearest.segments.first) > 0)
    ranges = np.sort(candidates.segments.range)
    assert np.sort(nearest.segments.range) == pytest.approx(ranges[:count])


@settings(max_examples=40)
@given(st.lists(st.booleans(), max_size=9))
def test_the_beams_of_chosen_candidates_are_marked(chosen) -> None:
    candidates = candidates_at([(2.0, float(k)) for k in range(len(chosen))])
    marked = candidates.beams(np.array(chosen, np.bool_), 100)
    expected = {10 * k + beam for k, one in enumerate(chosen) if one for beam in range(4)}
    assert len(marked) == 100 and set(np.flatnonzero(marked).tolist()) == expected


def test_the_last_beam_of_a_scan_is_marked() -> None:
    assert candidates_at([(2.0, 0.0)]).beams(np.array([True]), 4).all()


@settings(max_examples=30)
@given(st.floats(0.3, 6.0), st.floats(-1.0, 1.0))
def test_a_leg_lies_behind_its_returns(distance: float, bearing: float) -> None:
    across = 0.06 * np.array([-math.sin(bearing), math.cos(bearing)])
    middle = distance * np.array([math.cos(bearing), math.sin(bearing)])
    found = found_in(scan([middle - across, middle - 0.3 * across, middle + 0.3 * across, middle + across]))
    assert found.size == 1
    assert found.position[0] == pytest.approx(middle * (distance + LEG_DEPTH) / distance)
