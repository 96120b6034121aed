"""Tests when a place counts as seen to be free."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.people.motion_model import MotionState
from chefbot.people.observation import Observation
from chefbot.people.visibility import BODY_DEPTH, HALF_WIDTH, MAX_SPREAD, seen_free

BEAMS = 360
TURN = np.arange(BEAMS) * 2.0 * math.pi / BEAMS - math.pi
AHEAD = np.radians(np.arange(-60.0, 60.5, 1.0))
PLACES = st.tuples(st.floats(0.5, 6.0), st.floats(-math.pi, math.pi))


def observation(angles, end, start=0.0, sensor: SE2 = IDENTITY) -> Observation:
    n = len(angles)
    start, end = np.broadcast_to(start, n).astype(float), np.broadcast_to(end, n).astype(float)
    return Observation(sensor, angles, np.full(n, math.nan), start.copy(), end.copy(), np.ones(n, np.bool_))


def state(x: float, y: float, deviation: float = 0.0) -> MotionState:
    return MotionState(x, y, 0.0, 0.0, deviation**2, 0.0, 1.0)


@settings(max_examples=60)
@given(PLACES, st.floats(0.5, 8.0), st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_a_place_is_free_if_beams_end_behind_it(place, end: float, sensor) -> None:
    distance, bearing = place
    at = SE2(*sensor) @ SE2(distance * math.cos(bearing), distance * math.sin(bearing), 0.0)
    if abs(distance + BODY_DEPTH - end) > 1e-9:
        free = seen_free(observation(TURN, end, sensor=SE2(*sensor)), state(at.x, at.y))
        assert free == (1.0 if distance + BODY_DEPTH < end else 0.0)


@settings(max_examples=60)
@given(PLACES, st.floats(-math.pi, math.pi), st.floats(-5.0, 5.0))
def test_one_beam_that_ends_before_it_hides_a_place(place, bearing: float, yaw: float) -> None:
    distance, towards = place
    sensor = SE2(1.0, -2.0, yaw)
    at = sensor @ SE2(distance * math.cos(towards), distance * math.sin(towards), 0.0)
    end = np.full(BEAMS, 9.0)
    end[round((bearing + math.pi) / math.radians(1.0)) % BEAMS] = 0.2
    away = abs(math.remainder(bearing - towards, 2.0 * math.pi))
    half = max(math.atan2(HALF_WIDTH, distance), math.radians(1.0))
    free = seen_free(observation(TURN, end, sensor=sensor), state(at.x, at.y))
    if away < half - math.radians(0.6):
        assert free == 0.0, "the beam crosses the place"
    elif away > half + math.radians(1.6):
        assert free == 1.0, "the beam passes beside it"


@pytest.mark.parametrize(("start", "free"), [(0.0, 1.0), (1.5, 1.0), (2.5, 0.0)])
def test_floor_that_a_camera_does_not_see_is_not_free(start: float, free: float) -> None:
    assert seen_free(observation(AHEAD, 5.0, start), state(2.0, 0.0)) == free


@pytest.mark.parametrize("bearing", [-180.0, -90.0, -60.0, -58.0, 0.0, 58.0, 60.0, 90.0, 179.0])
def test_outside_the_field_of_view_nothing_is_seen(bearing: float) -> None:
    yaw = math.radians(bearing)
    free = seen_free(observation(AHEAD, 9.0), state(3.0 * math.cos(yaw), 3.0 * math.sin(yaw)))
    assert free == (1.0 if abs(bearing) < 57.0 else 0.0)


def test_behind_the_seam_of_a_full_turn_is_seen() -> None:
    assert seen_free(observation(TURN, 9.0), state(-3.0, 0.0)) == 1.0
    end = np.full(BEAMS, 9.0)
    end[-1] = 1.0
    assert seen_free(observation(TURN, end), state(-3.0, 0.0)) == 0.0


def test_the_place_of_the_sensor_is_not_seen() -> None:
    assert seen_free(observation(TURN, 9.0), state(0.05, 0.05)) == 0.0


def test_a_person_may_be_beside_what_is_seen_free() -> None:
    end = np.where(np.abs(AHEAD) < math.radians(6.0), 9.0, 1.0)
    assert seen_free(observation(AHEAD, end), state(3.0, 0.0, 0.0)) == 1.0
    assert seen_free(observation(AHEAD, end), state(3.0, 0.0, 1.0)) == pytest.approx(3.0 / 5.0)


@settings(max_examples=20)
@given(st.floats(MAX_SPREAD, 50.0))
def test_the_places_looked_at_are_not_far_from_the_mean(deviation: float) -> None:
    near = observation(TURN, np.where(np.abs(TURN) < 0.1, 9.0, 2.6))
    assert seen_free(near, state(3.0, 0.0, deviation)) == seen_free(near, state(3.0, 0.0, MAX_SPREAD))
