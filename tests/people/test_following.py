"""Following a person: who is chosen, the distance that is kept, and what happens when the person is lost."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, Vector3
from chefbot.msgs.nav2_msgs import CONTROLLING, INITIAL_PERCEPTION, RETRY, STOPPING
from chefbot.people.following import (
    FAILED_TO_DETECT_OBJECT,
    FollowingParams,
    PersonFollower,
    followed_person,
)

PARAMS = FollowingParams()
ORIGIN = SE2(0.0, 0.0, 0.0)


def person(number: int, x: float, y: float, *, visible: bool = True) -> TrackedPerson:
    return TrackedPerson(number, Point(x, y), Vector3(0.5, 0.0), visible=visible)


def people(*persons: TrackedPerson) -> TrackedPeople:
    return TrackedPeople(people=persons)


@given(st.floats(-10, 10), st.floats(-10, 10), st.floats(-3, 3), st.floats(-20, 20), st.floats(-20, 20))
def test_the_target_keeps_the_distance_and_faces_the_person(
    x: float, y: float, yaw: float, px: float, py: float
) -> None:
    robot = SE2(x, y, yaw)
    step = PersonFollower(PARAMS, 7, 0.0).step(robot, people(person(7, px, py)), 0.1)
    away = math.hypot(px - x, py - y)
    if step.target is None:
        assert step.state == STOPPING and away <= PARAMS.desired_distance + 0.25 + 1e-9
        return
    assert step.state == CONTROLLING
    to_person = math.hypot(px - step.target.x, py - step.target.y)
    assert to_person == pytest.approx(min(away, PARAMS.desired_distance), abs=0.251)
    if away > 0.01:
        assert abs(wrap(math.atan2(py - y, px - x) - step.target.yaw)) < 1e-6


def test_the_nearest_person_ahead_is_chosen() -> None:
    follower = PersonFollower(PARAMS, 0, 0.0)
    crowd = people(
        person(1, -0.5, 0.0),
        person(2, 3.0, 0.0),
        person(3, 2.0, 0.5),
        person(4, 1.0, 0.0, visible=False),
    )
    follower.step(ORIGIN, crowd, 0.1)
    assert follower.number == 3


@pytest.mark.parametrize(("number", "reason"), [(0, "No person is ahead"), (9, "Person 9 is not in sight")])
def test_nobody_to_follow_aborts_with_a_reason(number: int, reason: str) -> None:
    follower = PersonFollower(PARAMS, number, 0.0)
    behind = people(person(1, -2.0, 0.0))
    assert follower.step(ORIGIN, behind, 0.1).state == INITIAL_PERCEPTION
    assert follower.step(ORIGIN, None, 1.0).error_code == 0
    end = follower.step(ORIGIN, behind, PARAMS.detection_timeout)
    assert end.error_code == FAILED_TO_DETECT_OBJECT and reason in end.sentence


def lost_follower() -> PersonFollower:
    """Return one whose person 7 was last seen at (3, 0) at 1 s, while person 1 stood beside it."""
    follower = PersonFollower(PARAMS, 7, 0.0)
    follower.step(ORIGIN, people(person(7, 3.0, 0.0), person(1, 3.5, 0.5)), 1.0)
    return follower


def test_a_hidden_person_is_looked_for_then_given_up() -> None:
    follower, hidden = lost_follower(), people(person(7, 3.5, 0.0, visible=False))
    assert follower.step(ORIGIN, hidden, 2.0).target is not None
    step = follower.step(ORIGIN, hidden, 3.5)
    assert (step.state, follower.retries) == (RETRY, 1)
    assert step.target is not None and (step.target.x, step.target.y) == (3.0, 0.0)
    there = follower.step(SE2(2.8, 0.0, 0.0), hidden, 9.0)
    assert there.look_round and there.target is None and "Lost person 7" in there.sentence
    end = follower.step(SE2(2.8, 0.0, 0.0), hidden, 1.0 + PARAMS.detection_timeout + PARAMS.search_timeout)
    assert end.error_code == FAILED_TO_DETECT_OBJECT and "did not find it" in end.sentence


def test_a_lost_person_is_found_again_by_number_or_by_place() -> None:
    follower = lost_follower()
    follower.step(ORIGIN, people(), 4.0)
    assert follower.step(ORIGIN, people(person(7, 4.0, 0.0)), 4.5).state == CONTROLLING
    follower = lost_follower()
    follower.step(ORIGIN, people(), 4.0)
    bystander, far = person(1, 3.1, 0.0), person(8, 9.0, 0.0)
    assert follower.step(ORIGIN, people(bystander, far), 4.2).state == RETRY
    again = follower.step(ORIGIN, people(bystander, far, person(9, 4.0, 1.0)), 4.4)
    assert again.state == CONTROLLING and follower.number == 9


@pytest.mark.parametrize(
    ("frame", "number"),
    [("", 0), ("person", 0), ("person_7", 7), ("person_x", None), ("base_link", None), ("person_", 0)],
)
def test_frames_of_people(frame: str, number: int | None) -> None:
    assert followed_person(frame) == number
