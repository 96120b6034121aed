"""Tests doors and pedestrians without the rest of the simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.buildings.world_file import Door, Route
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.sim.world.doors import GAP, SPEED, MovingDoor
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.people import PERSONAL_SPACE, Pedestrian, disc, place_people
from chefbot.sim.world.shapes import clearance

FAR = (50.0, 50.0, 0.2)


def door(kind: str = "hinge", opened: float = 1.0) -> MovingDoor:
    return MovingDoor(Door(name="door", x=0.0, y=0.0, yaw=0.0, width=0.9, kind=kind, open=opened))  # type: ignore[arg-type]


def route(speed: float = 0.8) -> Route:
    return Route(points=[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]], speed=speed)  # type: ignore[list-item]


@given(st.sampled_from(["hinge", "slide"]), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_door_reaches_its_target_at_the_given_speed(kind: str, start: float, target: float) -> None:
    moving = door(kind, start)
    moving.target = target
    steps = 0
    while moving.moving:
        assert moving.advance(0.1, [FAR])
        steps += 1
    assert moving.open == target
    assert steps == pytest.approx(abs(target - start) / (0.1 * SPEED), abs=1.01)
    assert not moving.advance(0.1, [])


def test_a_target_within_one_step_is_reached_exactly() -> None:
    start, target = 0.005374569764496049, 0.042371686846861635
    assert start + (target - start) != target, "the sum of the floats misses it"
    one = door("hinge", start)
    one.target = target
    assert one.advance(0.1, [FAR]) and not one.moving
    assert one.open == target


@given(st.floats(0.1, 0.8), st.floats(0.05, 0.3))
@settings(max_examples=25)
def test_a_door_stops_before_it_hits_a_person(x: float, radius: float) -> None:
    closing = door()
    closing.target = 0.0
    person = (x, 0.3, radius)
    free = clearance([closing.shape], x, 0.3, -math.inf, math.inf) >= radius + GAP
    for _ in range(60):
        closing.advance(0.05, [person])
        if free:
            assert clearance([closing.shape], x, 0.3, -math.inf, math.inf) >= radius + GAP - 1e-9
    if free and radius > 0.3 - GAP:
        assert closing.moving, "the closed leaf would overlap the person"


@given(st.integers(0, 999))
@settings(max_examples=30)
def test_a_pedestrian_stays_on_the_route_and_within_its_speed(seed: int) -> None:
    pedestrian = Pedestrian(route(), np.random.default_rng(seed))
    for _ in range(300):
        before = pedestrian.pose
        pedestrian.advance(0.1, [FAR], [])
        assert pedestrian.pose.distance(before) <= 0.8 * 1.2 * 0.1 + 1e-9
        on_first = abs(pedestrian.pose.y) < 1e-9 and -1e-9 <= pedestrian.pose.x <= 4.0 + 1e-9
        on_second = abs(pedestrian.pose.x - 4.0) < 1e-9 and -1e-9 <= pedestrian.pose.y <= 3.0 + 1e-9
        assert on_first or on_second


@given(st.integers(0, 999), st.floats(0.0, 4.0), st.floats(-0.5, 0.5))
@settings(max_examples=30)
def test_a_pedestrian_keeps_its_distance_to_the_robot(seed: int, x: float, y: float) -> None:
    robot = (x, y, 0.2)
    pedestrian = Pedestrian(route(), np.random.default_rng(seed))
    for _ in range(200):
        before = math.dist((pedestrian.pose.x, pedestrian.pose.y), robot[:2])
        pedestrian.advance(0.1, [robot], [])
        gap = math.dist((pedestrian.pose.x, pedestrian.pose.y), robot[:2])
        assert gap >= min(before, PERSON_RADIUS + 0.2 + PERSONAL_SPACE) - 1e-9


def test_the_same_random_generator_gives_the_same_walk() -> None:
    def walk() -> list[SE2]:
        pedestrian = Pedestrian(route(), np.random.default_rng(7))
        return [pedestrian.pose for _ in range(100) if pedestrian.advance(0.1, [FAR], []) is None]

    assert walk() == walk()


def test_people_are_placed_apart_or_rejected() -> None:
    rngs = [np.random.default_rng(n) for n in range(40)]
    people = place_people([route()], 3, FAR, rngs)
    centres = [disc(person)[:2] for person in people]
    gaps = [math.dist(a, b) for i, a in enumerate(centres) for b in centres[:i]]
    assert min(gaps) > 2 * PERSON_RADIUS + PERSONAL_SPACE
    with pytest.raises(UserError, match="no room for person"):
        place_people([route()], 40, FAR, rngs)
    with pytest.raises(UserError, match="no routes"):
        place_people([], 1, FAR, rngs)
    assert place_people([], 0, FAR, rngs) == []
