"""Tests what counts as background: returns that stay, floor that was free, and obstacles of the map."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.people.background import CELL, HIT_TIME, MAX_STATIC_EVIDENCE, STATIC_EVIDENCE, Background
from chefbot.people.observation import Observation

LIMIT = 12.0
"""Distance up to which observations are entered, m."""
PERIOD = 0.1
"""Time between two observations, s."""


def beam(
    distance: float, bearing: float = 0.0, sensor: SE2 = IDENTITY, free: float | None = None
) -> Observation:
    """Return one beam that ends at a distance, or one without return that is free up to `free` m."""
    ranges, end = (math.nan, free) if free is not None else (distance, distance)
    row = [np.array([value]) for value in (bearing, ranges, 0.0, end)]
    return Observation(sensor, *row, np.ones(1, np.bool_))


def enter(
    background: Background, observation: Observation, times: int = 1, start: float = 0.0, person=False
) -> float:
    """Enter an observation some times; return the time of the next one."""
    for k in range(times):
        people = np.full(len(observation.angles), person)
        background.update(observation, people, start + k * PERIOD, LIMIT)
    return start + times * PERIOD


def was_free(background: Background, x: float, y: float = 0.0, after: float = -1.0) -> bool:
    return bool(background.was_free(np.array([[x, y]]), after)[0][0])


def stays(background: Background, x: float, y: float = 0.0) -> bool:
    return bool(background.was_free(np.array([[x, y]]), -1.0)[1][0])


@pytest.mark.parametrize("times", [1, STATIC_EVIDENCE - 1, STATIC_EVIDENCE, STATIC_EVIDENCE + 5])
def test_what_is_seen_often_in_one_place_stays(times: int) -> None:
    background = Background()
    enter(background, beam(3.05), times)
    assert stays(background, 3.05) == (times >= STATIC_EVIDENCE)


def test_cells_beside_what_stays_count_as_staying() -> None:
    background = Background()
    enter(background, beam(3.05), STATIC_EVIDENCE)
    around = {
        (x, y)
        for x in range(-3, 4)
        for y in range(-3, 4)
        if stays(background, 3.05 + x * CELL, 0.05 + y * CELL)
    }
    assert around == {(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)}


def test_two_returns_of_one_observation_count_once() -> None:
    background = Background()
    close = Observation(
        IDENTITY,
        np.array([0.0, 0.001]),
        np.full(2, 3.05),
        np.zeros(2),
        np.full(2, 3.05),
        np.ones(2, np.bool_),
    )
    enter(background, close, STATIC_EVIDENCE - 1)
    assert not stays(background, 3.05)


def test_people_are_not_background_however_long_they_stand() -> None:
    background = Background()
    now = enter(background, beam(3.05), MAX_STATIC_EVIDENCE)
    enter(background, beam(3.05), 1, now, person=True)
    assert not stays(background, 3.05)
    enter(background, beam(2.05), 50, person=True)
    assert not stays(background, 2.05)


@settings(max_examples=40)
@given(st.floats(-math.pi, math.pi), st.floats(1.5, 8.0), st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
def test_a_beam_shows_free_floor_up_to_its_return(
    bearing: float, distance: float, x: float, y: float
) -> None:
    background, sensor = Background(), SE2(x, y, 0.7)
    enter(background, beam(distance, bearing, sensor))
    ux, uy = math.cos(bearing + 0.7), math.sin(bearing + 0.7)

    def free(along: float) -> bool:
        return was_free(background, x + along * ux, y + along * uy)

    before = [free(along) for along in np.arange(0.1, distance - 0.35, 0.01)]
    assert sum(before) >= 0.7 * len(before), "the floor before the return, but for corners of cells"
    assert not free(distance), "the place of the return"
    assert not free(distance + 0.2), "what is behind it"
    assert not was_free(background, x - 0.5 * ux, y - 0.5 * uy), "what is behind the sensor"


def test_something_new_on_free_floor_is_new_until_it_stays() -> None:
    background = Background()
    now = enter(background, beam(0.0, free=5.0), 3)
    assert was_free(background, 3.05) and not stays(background, 3.05)
    now = enter(background, beam(3.05), STATIC_EVIDENCE - 1, now)
    assert was_free(background, 3.05) and not stays(background, 3.05)
    enter(background, beam(3.05), 2, now)
    assert stays(background, 3.05)


def test_floor_was_free_only_after_the_time_it_was_seen() -> None:
    background = Background()
    enter(background, beam(0.0, free=5.0), 1, start=20.0)
    assert was_free(background, 3.05, after=19.9)
    assert not was_free(background, 3.05, after=20.0)


def test_what_was_taken_away_no_longer_stays() -> None:
    background = Background()
    now = enter(background, beam(3.05), MAX_STATIC_EVIDENCE + 50)
    later = enter(background, beam(5.0), 1, now)
    assert stays(background, 3.05), "one beam does not outweigh many returns"
    enter(background, beam(5.0), 60, later)
    assert not stays(background, 3.05) and was_free(background, 3.05)


def test_beams_beside_a_return_do_not_free_its_cell() -> None:
    background, now = Background(), 0.0
    for _ in range(3 * STATIC_EVIDENCE):
        enter(background, beam(3.05), 1, now)
        now = enter(background, beam(5.0, bearing=0.005), 1, now + 0.5 * HIT_TIME)
    assert stays(background, 3.05) and not was_free(background, 3.05)


def test_nothing_is_entered_beyond_the_limit() -> None:
    background = Background()
    enter(background, beam(LIMIT + 1.0), 2 * STATIC_EVIDENCE)
    assert not stays(background, LIMIT + 1.0)
    assert was_free(background, LIMIT - 0.35) and not was_free(background, LIMIT + 0.2)


def test_places_far_apart_are_not_taken_for_each_other() -> None:
    background, away = Background(), 256 * CELL
    enter(background, beam(3.05), STATIC_EVIDENCE)
    now = enter(background, beam(0.0, free=2.0), 1)
    assert not stays(background, 3.05 + away) and not stays(background, 3.05, away)
    assert was_free(background, 1.05) and not was_free(background, 1.05 - away)
    enter(background, beam(3.05, sensor=SE2(away, 0.0, 0.0)), 1, now)
    assert not stays(background, 3.05), "the newer place replaces the older one"


@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf, 1e300])
def test_points_nowhere_were_never_free(x: float) -> None:
    background = Background()
    assert not was_free(background, x) and not stays(background, x) and not was_free(background, 0.0, x)


def test_a_clock_set_back_forgets_when_but_not_what() -> None:
    background = Background()
    now = enter(background, beam(3.05), STATIC_EVIDENCE, start=1000.0)
    enter(background, beam(2.05, bearing=1.0), 1, now)
    background.forget_times()
    assert stays(background, 3.05)
    assert not was_free(background, 1.05)
    enter(background, beam(0.0, free=5.0), 1, start=1.0)
    assert was_free(background, 1.05)


@settings(max_examples=50)
@given(st.integers(0, 10_000), st.floats(-4.0, 4.0), st.floats(0.0, 0.6))
def test_points_near_obstacles_of_the_map_are_on_it(seed: int, yaw: float, margin: float) -> None:
    rng = np.random.default_rng(seed)
    cells = rng.choice([UNKNOWN, FREE, 64, 65, OCCUPIED], (12, 15), p=[0.2, 0.6, 0.1, 0.05, 0.05]).astype(
        np.int8
    )
    grid, frame = Grid(cells, 0.2, -1.0, -0.5), SE2(0.3, -0.2, yaw)
    points = rng.uniform(-2.5, 2.5, (20, 2))
    background = Background()
    assert not background.has_map
    background.set_map(grid)
    assert background.has_map
    near, floor = background.on_map(points, frame, np.full(20, margin))
    obstacles = np.argwhere(cells >= 65)
    for k, (x, y) in enumerate(frame.apply(points)):
        row, column = math.floor((y + 0.5) / 0.2), math.floor((x + 1.0) / 0.2)
        inside = 0 <= row < 12 and 0 <= column < 15
        gaps = 0.2 * np.hypot(*(obstacles - (row, column)).T) if inside else np.array([])
        if abs(min(gaps, default=math.inf) - margin) < 1e-5:
            continue
        assert near[k] == (min(gaps, default=math.inf) <= margin)
        assert floor[k] == (inside and cells[row, column] != UNKNOWN and not near[k])


def test_without_map_or_transform_nothing_is_on_the_map() -> None:
    background, points = Background(), np.zeros((3, 2))
    assert [part.tolist() for part in background.on_map(points, IDENTITY, np.ones(3))] == [[False] * 3] * 2
    background.set_map(Grid(np.full((4, 4), OCCUPIED, np.int8), 0.5, -1.0, -1.0))
    assert [part.tolist() for part in background.on_map(points, None, np.ones(3))] == [[False] * 3] * 2
    assert background.on_map(points, IDENTITY, np.ones(3))[0].all()


def test_on_a_map_without_obstacles_all_floor_is_free() -> None:
    background = Background()
    background.set_map(Grid(np.zeros((4, 4), np.int8), 0.5, -1.0, -1.0))
    near, floor = background.on_map(np.array([[0.0, 0.0], [5.0, 0.0]]), IDENTITY, np.ones(2))
    assert near.tolist() == [False, False] and floor.tolist() == [True, False]
