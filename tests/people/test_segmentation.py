"""Tests how returns fall into segments, and the features of these."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.people.observation import Observation
from chefbot.people.segmentation import MAX_SEGMENTS, find_segments

STEP = math.radians(1.0)
RANGES = st.lists(st.one_of(st.just(math.nan), st.floats(0.3, 8.0)), min_size=0, max_size=40)
NAN = math.nan


def seen(ranges, sensor: SE2 = IDENTITY, upright=None, step: float = STEP) -> Observation:
    ranges = np.array(ranges, float)
    high = np.ones(len(ranges), np.bool_) if upright is None else np.array(upright, np.bool_)
    angles, end = step * np.arange(len(ranges)), np.where(np.isnan(ranges), 0.0, ranges)
    return Observation(sensor, angles, ranges, np.zeros(len(ranges)), end, high)


def beams_of(observation: Observation) -> list[tuple[int, int]]:
    segments = find_segments(observation)
    return list(zip(segments.first.tolist(), segments.last.tolist(), strict=True))


def expected(observation: Observation) -> list[list[int]]:
    """Return the beams of each segment: neighbours that return and are near each other."""
    points, found = observation.points(), list[list[int]]()
    for i, distance in enumerate(observation.ranges):
        if math.isnan(distance):
            continue
        joined = bool(found) and found[-1][-1] == i - 1
        if joined:
            allowed = max(0.08, 2.2 * STEP * min(distance, observation.ranges[i - 1]))
            joined = math.dist(points[i], points[i - 1]) <= allowed
        if joined:
            found[-1].append(i)
        else:
            found.append([i])
    return found


@settings(max_examples=60)
@given(RANGES, st.floats(-3.0, 3.0), st.integers(0, 1000))
def test_segments_are_runs_of_returns_without_a_jump(ranges, yaw: float, seed: int) -> None:
    upright = np.random.default_rng(seed).random(len(ranges)) < 0.5
    observation = seen(ranges, SE2(1.0, -2.0, yaw), upright)
    segments, parts = find_segments(observation), expected(observation)
    assert beams_of(observation) == [(part[0], part[-1]) for part in parts]
    points = observation.points()
    for k, part in enumerate(parts):
        centre = points[part].mean(axis=0)
        assert segments.centre[k] == pytest.approx(centre)
        assert segments.range[k] == pytest.approx(math.dist(centre, (1.0, -2.0)))
        assert segments.width[k] == pytest.approx(math.dist(points[part[0]], points[part[-1]]))
        assert segments.returns[k] == len(part)
        assert segments.upright[k] == pytest.approx(upright[part].mean())


def test_a_step_in_depth_ends_a_segment_by_hand() -> None:
    assert beams_of(seen([1.0, 1.0, 1.05, 1.14, 1.14])) == [(0, 2), (3, 4)]
    assert beams_of(seen([1.0, NAN, 1.0])) == [(0, 0), (2, 2)]
    assert beams_of(seen([4.0, 4.13, 4.0])) == [(0, 2)], "beams are farther apart at a distance"
    assert beams_of(seen([4.0, 4.14, 4.0])) == [(0, 0), (1, 1), (2, 2)], "of the nearer return"
    assert beams_of(seen([NAN, NAN])) == [] and beams_of(seen([])) == []


@pytest.mark.parametrize(
    ("ranges", "hidden"),
    [
        ([1.0, 2.0, 2.0, 3.0], [False, True, True]),
        ([3.0, 2.0, 2.0, 1.0], [True, True, False]),
        ([1.9, 2.0, 2.0, 1.9], [False, False, False]),
        ([NAN, 2.0, 2.0, NAN], [False]),
        ([2.0, 2.0], [False]),
    ],
)
def test_a_nearer_return_beside_it_hides_a_segment(ranges, hidden) -> None:
    assert find_segments(seen(ranges)).hidden.tolist() == hidden


@settings(max_examples=50)
@given(RANGES)
def test_mirrored_beams_give_mirrored_segments(ranges) -> None:
    ahead, back = beams_of(seen(ranges)), beams_of(seen(ranges[::-1]))
    assert [(len(ranges) - 1 - last, len(ranges) - 1 - first) for first, last in back[::-1]] == ahead


def test_a_bounded_number_of_segments_is_found() -> None:
    ranges = np.where(np.arange(2 * MAX_SEGMENTS + 20) % 2, 1.0, 5.0)
    segments = find_segments(seen(ranges, step=1e-4))
    assert segments.size == MAX_SEGMENTS
    assert segments.first.tolist() == list(range(MAX_SEGMENTS))


@settings(max_examples=30)
@given(RANGES, st.integers(0, 1000))
def test_chosen_segments_keep_their_features(ranges, seed: int) -> None:
    segments = find_segments(seen(ranges))
    mask = np.random.default_rng(seed).random(segments.size) < 0.5
    chosen = segments.selected(mask)
    assert chosen.size == mask.sum()
    for column, kept in zip(segments, chosen, strict=True):
        assert np.array_equal(column[mask], kept)
    numbers = segments.selected(np.flatnonzero(mask))
    assert all(np.array_equal(a, b) for a, b in zip(numbers, chosen, strict=True))
