"""Tests that each kind of people does what its name means, each in a small drawn scene."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.sim.people.scenes import Scene, chair, room, two_rooms

from chefbot.buildings.people_spec import KINDS, PeopleSpec, people_of_each_kind
from chefbot.buildings.world_file import Door
from chefbot.config import ConfigError, build
from chefbot.sim.device import SimulatorParams
from chefbot.sim.people.casting import leaders_of
from chefbot.sim.people.chairs import TRAVEL
from chefbot.sim.people.walkers import STAND
from chefbot.sim.world.world import parse_world

TWO_ROOMS = (-0.1, -0.1, 8.1, 4.1)


def test_talkers_stand_in_a_doorway_face_to_face() -> None:
    scene = Scene(two_rooms(1.0), TWO_ROOMS, PeopleSpec(count=2, stand_and_talk=1.0), 1)
    assert [(place.x, place.y) for place, _ in scene.people.doorways] == [
        (pytest.approx(4.0, abs=0.15), pytest.approx(2.0, abs=0.15))
    ]
    together = 0
    for _ in range(60):
        scene.run(1.0)
        w = scene.people.walkers
        in_doorway = np.hypot(*(w.position - (4.0, 2.0)).T).max() < 0.7
        if in_doorway and (w.mode == STAND).all() and w.heading[0] @ w.heading[1] < -0.8:
            together += 1
    assert together >= 8


def test_a_group_stays_together() -> None:
    scene = Scene(two_rooms(1.0), TWO_ROOMS, PeopleSpec(count=3, groups=1.0, group_size=3), 3)
    positions = scene.run(60.0)
    centre = positions.mean(axis=1, keepdims=True)
    away = np.hypot(*np.moveaxis(positions - centre, 2, 0))
    assert np.median(away) < 1.2
    assert np.hypot(*np.diff(positions[:, 0], axis=0).T).sum() > 10.0


def test_someone_steps_out_from_behind_a_corner() -> None:
    corner = room(8.0, 6.0, [(3.0, 2.0, 3.0, 6.0), (5.0, 2.0, 5.0, 6.0)])
    scene = Scene(corner, (-0.1, -0.1, 8.1, 6.1), PeopleSpec(count=1, step_out=1.0), 1, (0.5, 1.0))
    assert scene.people.hiding_places
    scene.run(25.0)
    hidden = scene.people.walkers.position[0].copy()
    assert any(math.dist(hidden, place[:2]) < 0.5 for place, _ in scene.people.hiding_places)
    assert not scene.people.floor.in_sight(*hidden, *scene.people.robot_seen)
    positions = scene.run(14.0, (0.4, 0.0))[:, 0]
    out = min(
        np.hypot(*(positions - (place.out_x, place.out_y)).T).min()
        for place, _ in scene.people.hiding_places
        if math.dist(hidden, place[:2]) < 0.5
    )
    assert out < 0.3


def test_chairs_are_pulled_out_and_pushed_in() -> None:
    spec = PeopleSpec(count=1, pull_chairs=1.0)
    scene = Scene([*room(6.0, 5.0), *chair(4.0, 2.5, 0.0)], (0.0, 0.0, 6.0, 5.0), spec, 1)
    [movable] = scene.people.movable
    out = []
    for _ in range(180):
        scene.run(0.5)
        out.append(movable.out)
    assert max(out) == pytest.approx(TRAVEL, abs=0.05)
    assert min(out[out.index(max(out)) :]) < 0.05


def test_chairs_of_a_world_stay_without_who_uses_them() -> None:
    scene = Scene([*room(6.0, 5.0), *chair(4.0, 2.5, 0.0)], (0.0, 0.0, 6.0, 5.0), PeopleSpec(count=3), 1)
    assert scene.people.movable == []


def test_a_chair_stops_before_the_robot() -> None:
    spec = PeopleSpec(count=1, pull_chairs=1.0)
    scene = Scene([*room(6.0, 5.0), *chair(4.0, 2.5, 0.0)], (0.0, 0.0, 6.0, 5.0), spec, 1)
    [movable] = scene.people.movable
    movable.target = TRAVEL
    for _ in range(100):
        movable.advance(0.04, [(3.4, 2.5, 0.2)])
    assert 0.0 < movable.out < 0.15


def test_doors_are_opened_and_closed() -> None:
    door = Door(name="door", x=4.0, y=1.5, yaw=math.pi / 2, width=1.0, swing=-math.pi / 2)
    scene = Scene(two_rooms(1.0), TWO_ROOMS, PeopleSpec(count=2, doors=1.0), 1, doors=[door])
    openings = []
    for _ in range(150):
        scene.run(1.0)
        openings.append(scene.doors[0].open)
    assert min(openings) == 0.0
    assert max(openings[openings.index(0.0) :]) == 1.0


def test_followers_keep_behind_the_robot() -> None:
    scene = Scene(room(14.0, 4.0), (0.0, 0.0, 14.0, 4.0), PeopleSpec(count=1, follow=1.0), 1, (2.0, 2.0))
    scene.put(0, 1.0, 1.0)
    scene.run(20.0, (0.5, 0.0))
    gap = scene.to_robot(scene.people.walkers.position)[0]
    assert 0.1 < gap < 1.5
    assert scene.people.walkers.position[0, 0] < scene.robot.x


def test_blockers_stand_in_front_of_the_robot() -> None:
    scene = Scene(room(14.0, 4.0), (0.0, 0.0, 14.0, 4.0), PeopleSpec(count=1, block=1.0), 1, (2.0, 2.0))
    scene.put(0, 4.0, 1.0)
    ahead = 0
    for _ in range(100):
        position = scene.run(0.2, (0.2, 0.0))[-1, 0]
        dx, dy = position[0] - scene.robot.x, position[1] - scene.robot.y
        ahead += bool(0.4 < dx < 1.0 and abs(dy) < 0.3)
    assert ahead > 10


@given(st.integers(0, 50), st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7))
def test_the_kinds_add_up_to_everybody(count: int, weights: list[float]) -> None:
    total = max(sum(weights), 1.0)
    spec = PeopleSpec(count=count, **{kind: w / total for kind, w in zip(KINDS, weights, strict=True)})
    numbers = people_of_each_kind(spec)
    assert sum(numbers.values()) <= count
    assert all(abs(numbers[kind] - getattr(spec, kind) * count) <= 1.0 for kind in KINDS)
    assert len(leaders_of(spec)) == count


@pytest.mark.parametrize(
    ("people", "message"),
    [
        (51, "people: 51 must be at most 50"),
        (-2, "people: -2 must be at least -1"),
        ({"count": 3, "follows": 1.0}, "unknown key 'people.follows'.*did you mean 'follow'"),
        ({"count": 3, "follow": 0.6, "block": 0.6}, "add up to 1.2"),
        ({"count": 3, "slowest": 2.0, "fastest": 1.0}, "slowest speed, 2 m/s, is above"),
        ({"count": 3, "fastest": 9.0}, "people.fastest: 9.0 must be at most 2.5"),
        ("many", "people"),
    ],
)
def test_people_that_cannot_be_are_rejected(people: object, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        build({"people": people}, SimulatorParams, "node simulator: params")


def test_people_are_given_as_a_number_or_as_a_section() -> None:
    params = build({"people": {"count": 3, "fastest": 1.5}}, SimulatorParams, "params")
    assert params.people == PeopleSpec(count=3, fastest=1.5)
    assert build({"people": 12}, SimulatorParams, "params").people == 12


def test_a_world_file_names_people_by_number_or_section() -> None:
    text = "name: hut\nplaces: {home: {x: 0 m, y: 0 m}}\npeople: "
    assert parse_world((text + "3").encode(), "hut").people == PeopleSpec(count=3)
    section = parse_world((text + "{count: 4, follow: 0.5}").encode(), "hut").people
    assert section == PeopleSpec(count=4, follow=0.5)
    with pytest.raises(ConfigError, match=r"unknown key 'people.folow'.*did you mean 'follow'"):
        parse_world((text + "{count: 4, folow: 0.5}").encode(), "hut")
    with pytest.raises(ConfigError, match="people: 51 must be at most 50"):
        parse_world((text + "51").encode(), "hut")


def test_parameters_read_back_as_they_were_written() -> None:
    params = SimulatorParams(people=PeopleSpec(count=4, follow=0.5))
    assert build(msgspec.to_builtins(params), SimulatorParams, "params") == params
