"""Tests the evidence that a track is a person, and what is reported of it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.people.candidates import Measurement
from chefbot.people.motion_model import MotionState, propagate
from chefbot.people.track import (
    CONFIRMED_EVIDENCE,
    MAX_EVIDENCE,
    ON_MAP_EVIDENCE,
    REFUTED_EVIDENCE,
    STANDING_TIME,
    STILL_EVIDENCE,
    TENTATIVE_ID,
    UNSEEN_DELAY,
    VISIBLE_TIME,
    PersonTrack,
    Sighting,
)

FLAGS = ("novel", "pair", "body", "leg", "on_map")


def state(x: float = 0.0, speed: float = 0.0, speed_variance: float = 1e-4) -> MotionState:
    return MotionState(x, 0.0, speed, 0.0, 0.01, 0.0, speed_variance)


def track(evidence: float = 0.0, number: int = TENTATIVE_ID) -> PersonTrack:
    first = Sighting(0.0, 0.0, 10.0)
    return PersonTrack(number, state(), 10.0, first, first, evidence)


def seen(*flags: str, x: float = 0.0) -> Measurement:
    return Measurement(x, 0.0, 0.06, **{flag: flag in flags for flag in FLAGS})


def gained(*flags: str, at: MotionState | None = None) -> float:
    """Return the evidence that a measurement adds."""
    one = track()
    one.take(at or state(), seen(*flags))
    return one.evidence


def test_more_of_a_person_is_more_evidence() -> None:
    kinds = [
        gained(),
        gained("leg"),
        gained("body"),
        gained("pair"),
        gained("novel"),
        gained("novel", "pair"),
    ]
    assert kinds == sorted(kinds) and len(set(kinds)) == len(kinds)
    assert kinds[0] == STILL_EVIDENCE < 0.0 < kinds[1]
    assert gained("pair", "body", "leg") == gained("pair"), "legs are counted once"


@given(st.sets(st.sampled_from(FLAGS[:4])))
def test_an_obstacle_of_the_map_is_evidence_against(flags: set[str]) -> None:
    assert gained("on_map", *flags) == ON_MAP_EVIDENCE
    assert gained(*flags, at=state(1.0, 3.5)) == ON_MAP_EVIDENCE, "nobody is so fast"


@pytest.mark.parametrize(
    ("at", "moves"),
    [
        (state(1.0, 0.5), True),
        (state(0.2, 0.5), False),
        (state(1.0, 0.25), False),
        (state(1.0, 0.5, 0.09), False),
        (state(1.0, 0.7, 0.09), True),
    ],
)
def test_who_surely_moved_away_is_a_person(at: MotionState, moves: bool) -> None:
    assert (gained(at=at) > 0.0) == moves
    assert (gained("pair", at=at) > gained("pair")) == moves


@settings(max_examples=40)
@given(st.lists(st.tuples(st.sets(st.sampled_from(FLAGS)), st.floats(0.0, 4.0)), max_size=30))
def test_evidence_is_bounded_and_so_is_the_confidence(history) -> None:
    one = track()
    for flags, speed in history:
        one.take(state(1.0, speed), seen(*flags))
        assert one.evidence <= MAX_EVIDENCE
        assert one.confidence == pytest.approx(1.0 / (1.0 + math.exp(-one.evidence)))
        assert 0.0 <= one.confidence <= 1.0
    assert one.measurements == 1 + len(history)


def test_even_odds_are_a_probability_of_one_half() -> None:
    assert track().confidence == 0.5
    assert track(math.log(3.0)).confidence == pytest.approx(0.75)


def test_evidence_against_a_person_counts_half_until_confirmed() -> None:
    assert not track(0.4 * REFUTED_EVIDENCE).over and track(0.5 * REFUTED_EVIDENCE).over
    assert not track(0.9 * REFUTED_EVIDENCE, 7).over and track(REFUTED_EVIDENCE, 7).over


def test_a_person_is_likely_whatever_the_evidence() -> None:
    assert track(-1.0, 3).likely and track(-1.0, 3).confirmed
    assert not track().likely and not track().confirmed
    assert track(CONFIRMED_EVIDENCE).likely and not track(CONFIRMED_EVIDENCE).confirmed, (
        "a number is given by the tracker"
    )


def test_who_is_slow_for_a_while_stands() -> None:
    one = track(number=1)
    for k in range(30):
        one.advance(10.0 + 0.1 * k, 1.0)
        one.take(state(0.1), seen("leg", x=0.1))
        assert one.standing == (one.time - 10.0 >= STANDING_TIME)
    one.take(state(0.1, 0.5), seen("leg"))
    assert not one.standing, "one step is enough"
    one.take(state(0.1), seen("leg"))
    assert not one.standing and one.standing_since == one.time


def test_who_was_seen_just_now_is_visible() -> None:
    one = track()
    one.advance(10.0 + 0.9 * VISIBLE_TIME, 1.0)
    assert one.visible
    one.advance(10.0 + 1.1 * VISIBLE_TIME, 1.0)
    assert not one.visible
    one.take(state(), seen("leg", x=0.3))
    assert one.visible and one.last_seen == Sighting(0.3, 0.0, one.time)
    assert one.first == Sighting(0.0, 0.0, 10.0)


@settings(max_examples=30)
@given(st.floats(0.0, 0.9), st.floats(0.1, 2.0))
def test_the_seen_keep_their_velocity(share: float, speed: float) -> None:
    one = track()
    one.state = state(0.0, speed)
    one.advance(10.0 + share * UNSEEN_DELAY, 0.5)
    assert one.state == propagate(state(0.0, speed), one.time - 10.0, 0.5)
    assert one.state.speed == speed


def test_the_unseen_slow_down_and_stop() -> None:
    one = track()
    one.state = state(0.0, 1.0)
    for k in range(1, 100):
        one.advance(10.0 + 0.1 * k, 0.5)
    assert one.state.speed < 0.01
    assert UNSEEN_DELAY < one.state.x < UNSEEN_DELAY + 2.0, "it comes to rest within two metres"


def test_an_older_time_changes_nothing() -> None:
    one = track()
    one.state = state(0.0, 1.0)
    one.advance(9.0, 0.5)
    assert one.time == 10.0 and one.state == state(0.0, 1.0)
