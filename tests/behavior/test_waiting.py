"""Waiting or the other path: expected times, standing people, patience."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.behavior.recovery import WaitingParams
from chefbot.behavior.waiting import (
    BLOCKAGE_MEMORY,
    OBSTACLE_WAIT,
    StandingTimes,
    WaitingPolicy,
    expected_remaining_wait,
    person_ahead,
)
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import FindBlockage_Result
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.std_msgs import Header

PARAMS = WaitingParams()
SPEED = 0.5


def people(now: float, *places: tuple[float, float], standing: bool = True) -> TrackedPeople:
    tracked = (TrackedPerson(i, Point(*at), standing=standing) for i, at in enumerate(places, start=1))
    return TrackedPeople(Header.of(round(now * 1e9), "odom"), tuple(tracked))


def blockage(*numbers: int, extra: float = math.inf, x: float = 3.0) -> FindBlockage_Result:
    around = math.isfinite(extra)
    return FindBlockage_Result(
        blocked=True,
        people=np.array(numbers, np.uint32),
        alternative_path=around,
        extra_length=extra if around else 0.0,
        point=Point(x),
    )


def standing(seconds: float) -> StandingTimes:
    """Return a person who has stood from 0 s on until now, `seconds`."""
    times = StandingTimes()
    for now in np.arange(0.0, seconds + 0.05, 0.1):
        times.process(people(float(now), (2.0, 0.0)))
    return times


@pytest.mark.parametrize("stood", [0.0, 5.0, 60.0])
def test_the_expected_wait_is_the_mean_residual_life(stood: float) -> None:
    """Compare with the survival function of Lomax's distribution, integrated from `stood` on."""
    typical = 10.0
    t = np.geomspace(stood + typical, 1e7, 200_000) - typical
    survival = (1.0 + t / typical) ** -2.0
    mean = np.trapezoid(survival, t) / survival[0]
    assert expected_remaining_wait(stood, typical) == pytest.approx(mean, rel=1e-3)


def test_standing_ends_with_a_step_but_not_with_a_turn() -> None:
    times = standing(10.0)
    assert times.stood(1, 10.0) == pytest.approx(10.0)
    times.process(people(10.1, (2.1, 0.1)))
    assert times.stood(1, 10.1) == pytest.approx(10.1)
    times.process(people(10.2, (2.6, 0.1)))
    assert times.stood(1, 10.2) == 0.0
    times.process(people(10.3, (2.6, 0.1), standing=False))
    assert times.stood(1, 12.0) < 2.0 and times.stood(7, 12.0) == 0.0


@pytest.mark.parametrize(
    ("stood", "extra", "waits"), [(2.0, 12.0, True), (2.0, 5.0, False), (30.0, 12.0, False)]
)
def test_it_waits_while_that_is_shorter_than_the_other_path(stood: float, extra: float, waits: bool) -> None:
    decision = WaitingPolicy(SPEED).decide(blockage(1, extra=extra), standing(stood), stood, PARAMS)
    assert decision.waits == waits and not decision.gives_up
    numbers = {one.name: one.value for one in decision.numbers}
    assert numbers["expected wait"] == pytest.approx(10.0 + stood, abs=0.2)
    assert numbers["detour"] == pytest.approx(extra / SPEED)
    assert f"the other path {extra / SPEED:.0f} s longer" in decision.sentence


def test_a_place_that_stays_blocked_is_left_for_good() -> None:
    """A tracker may take glass for people: each of its new tracks has stood for a moment only."""
    policy, waits = WaitingPolicy(SPEED), []
    for now in np.arange(100.0, 200.0):
        times = StandingTimes()
        for seen in (now - 2.0 - now % 5.0, now):
            times.process(people(seen, (2.0, 0.0)))
        waits.append(policy.decide(blockage(1, extra=15.0), times, now, PARAMS).waits)
    assert waits[0] and not any(waits[20:])


def test_it_drives_around_people_who_walk() -> None:
    policy, times = WaitingPolicy(SPEED), StandingTimes()
    times.process(people(0.0, (2.0, 0.0), standing=False))
    assert not policy.decide(blockage(1, extra=20.0), times, 0.1, PARAMS).waits
    assert policy.decide(blockage(1), times, 0.1, PARAMS).waits


def test_it_does_not_give_up_on_people_before_its_patience() -> None:
    policy, times = WaitingPolicy(SPEED), StandingTimes()
    for now in range(300):
        assert policy.decide(blockage(1, x=3.0 + 0.3 * (now % 2)), times, float(now), PARAMS).waits
    decision = policy.decide(blockage(1), times, 300.0, PARAMS)
    assert decision.gives_up and "300 s" in decision.sentence


def test_another_place_and_a_free_path_restart_patience() -> None:
    policy, times = WaitingPolicy(SPEED), StandingTimes()
    policy.decide(blockage(1), times, 0.0, PARAMS)
    policy.decide(blockage(1), times, 100.0 - BLOCKAGE_MEMORY / 2, PARAMS)
    assert policy.decide(FindBlockage_Result(), times, 100.0, PARAMS).waits is False
    policy.decide(blockage(1, x=9.0), times, 101.0, PARAMS)
    assert policy.waited(101.0) == 0.0
    policy.decide(blockage(1, x=9.0), times, 200.0, PARAMS)
    assert policy.waited(200.0) == 0.0


def test_recoveries_interrupt_waiting_ever_later() -> None:
    policy, times, now, stretches = WaitingPolicy(SPEED), StandingTimes(), 0.0, []
    for _ in range(3):
        policy.begin()
        began = now
        while policy.decide(blockage(), times, now, PARAMS).waits:
            now += 1.0
        stretches.append(now - began)
    assert stretches == [OBSTACLE_WAIT, 2 * OBSTACLE_WAIT, 4 * OBSTACLE_WAIT]


def test_who_stands_before_the_robot() -> None:
    tracked = people(0.0, (1.0, 1.0), (2.0, 1.0), (0.0, 1.0))
    robot = SE2(1.0, 0.0, math.pi / 2)
    assert person_ahead(tracked, robot, 1.3) == 1
    assert person_ahead(tracked, SE2(1.0, 0.0, -math.pi / 2), 1.3) is None
    assert person_ahead(TrackedPeople(), robot, 1.3) is None
